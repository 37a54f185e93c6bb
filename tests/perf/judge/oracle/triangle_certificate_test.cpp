// A plane that the certificate finds has no triangles on both sides, and it finds one for nearly all that are apart.
#include "perf/judge/oracle/triangle_certificate.h"

#include "tests/kernels/surface/random_triangles.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

namespace cab::tests {
namespace {

Triangle<double> in_double(const Triangle<Wide>& triangle) {
  Triangle<double> out;
  for (std::size_t k = 0; k < 3; ++k)
    for (std::size_t c = 0; c < 3; ++c) out.corner[k][c] = static_cast<double>(triangle.corner[k][c]);
  return out;
}

}  // namespace

TEST_CASE("triangles at integers that are certainly apart do not meet, and nearly all others do") {
  Random random(190);
  std::size_t touching = 0, apart = 0, left = 0;
  const std::uint64_t count = rounds(20000);
  for (std::uint64_t round = 0; round < count; ++round) {
    constexpr std::int64_t kSizes[] = {8, 64, 1 << 20};
    const std::int64_t size = kSizes[round % 3];
    GridPairs pairs(random, size);
    const GridPair pair = pairs.draw(static_cast<GridRegime>(round % kGridRegimeCount));
    const bool certain = certainly_apart(in_double(pair.a), in_double(pair.b), static_cast<double>(2 * size), 0);
    if (meet(pair.a, pair.b)) {
      CHECK_FALSE(certain);
      ++touching;
    } else {
      ++(certain ? apart : left);
    }
  }
  CHECK(touching >= least_count(2000, 20000));
  CHECK(apart >= least_count(2000, 20000));
  CHECK(left < apart / 20);
}

TEST_CASE("triangles of any doubles that are certainly apart by so much are so far apart") {
  Random random(191);
  std::size_t apart = 0, near = 0;
  const std::uint64_t count = rounds(20000);
  for (std::uint64_t round = 0; round < count; ++round) {
    const FloatPair pair = draw_floats(random, static_cast<FloatRegime>(round % kFloatRegimeCount), 1, 1);
    Triangle<double> quick[2];
    Triangle<Real> exact[2];
    double reach = 0;
    for (std::size_t s = 0; s < 2; ++s)
      for (std::size_t k = 0; k < 3; ++k) {
        for (std::size_t c = 0; c < 3; ++c) {
          quick[s].corner[k][c] = static_cast<double>(pair.corner[s][k][c]);
          exact[s].corner[k][c] = static_cast<Real>(pair.corner[s][k][c]);
        }
        reach = std::max(reach, norm_max(quick[s].corner[k]));
      }
    const Real truth = distance(exact[0], exact[1]);
    for (const double share : {0.0, 0.5, 0.999999, 1.0}) {
      const bool certain = certainly_apart(quick[0], quick[1], reach, share * static_cast<double>(truth));
      if (truth == 0 || share == 1) CHECK_FALSE(certain);
      apart += certain;
      near += certain && truth < 1e-3L;
    }
  }
  CHECK(apart >= least_count(2000, 20000));
  CHECK(near >= least_count(100, 20000));
}

}  // namespace cab::tests
