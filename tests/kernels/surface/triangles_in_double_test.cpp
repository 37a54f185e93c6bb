// The last word on two triangles, in double, against exact integers and a judge in long double.
#include "kernels/surface/triangles_in_double.h"

#include "tests/kernels/surface/random_triangles.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <cmath>

namespace cab::tests {
namespace {

constexpr std::uint64_t kSeed = 2030;

kernel::TriangleLanes<double> lanes_of(const TriangleBlock& block, int side, std::uint32_t lane) {
  const auto& c = block.corner[side];
  kernel::TriangleLanes<double> out;
  for (int k = 0; k < 3; ++k) out.corner[k] = {c[k][0][lane], c[k][1][lane], c[k][2][lane]};
  return out;
}

bool touch(const TriangleBlock& block, double error, double margin) {
  return kernel::touch_in_double(lanes_of(block, 0, 0), lanes_of(block, 1, 0), error, margin);
}

}  // namespace

TEST_CASE("triangles on a grid of 2^8 touch in double as they do by exact integers") {
  Random random(kSeed);
  constexpr std::uint64_t kUsual = 20000;
  for (std::uint32_t r = 0; r < kGridRegimeCount; ++r) {
    std::uint64_t lost = 0, extra = 0, touching = 0, count = 0;
    for (std::uint64_t round = 0; round < rounds(kUsual); ++round, ++count) {
      GridPairs pairs(random, std::int64_t{1} << (2 + random.index(7)));
      const GridPair pair = pairs.draw(static_cast<GridRegime>(r));
      TriangleBlock block{};
      put(pair, std::ldexp(3.0f, static_cast<int>(random.index(100)) - 55), block, 0);
      const bool truth = oracle::meet(pair.a, pair.b);
      const bool answer = touch(block, 0, 0);
      touching += truth;
      lost += truth && !answer;
      extra += answer && !truth;
    }
    CAPTURE(r);
    MESSAGE("regime " << r << ": " << touching << " of " << count << " touch, " << extra << " extra");
    CHECK(lost == 0);
    CHECK(extra == 0);
    CHECK(touching >= least_count(400, kUsual));
    CHECK(count - touching >= least_count(400, kUsual));
  }
}

TEST_CASE("triangles of any floats are within the margin in double as they are in long double") {
  Random random(kSeed + 1);
  // Distances that double takes for the margin, a share of the size. The worst of 400 000 is 2e-11, of flat pairs.
  constexpr Real kSlack = 1e-9L;
  constexpr std::uint64_t kUsual = 20000;
  for (std::uint32_t r = 0; r < kFloatRegimeCount; ++r) {
    std::uint64_t lost = 0, extra = 0, apart = 0;
    Real worst = 0;
    for (std::uint64_t round = 0; round < rounds(kUsual); ++round) {
      const double size = random.log_uniform(1e-18, 1e15);
      TriangleBlock block{};
      put(draw_floats(random, static_cast<FloatRegime>(r), size, random.chance(0.5) ? 0 : 10), block, 0);
      const Real between = distance(triangle_of(block, 0, 0), triangle_of(block, 1, 0));
      double margin =
          random.chance(0.3) ? 0 : static_cast<double>(between) * (1 + random.sign() * random.log_uniform(1e-15, 1));
      if (between == 0) margin = random.chance(0.5) ? 0 : 0.1 * size;
      const bool answer = touch(block, 0, margin);
      const bool is_apart = between > static_cast<Real>(margin);
      lost += !is_apart && !answer;
      if (is_apart && answer) worst = std::max(worst, (between - static_cast<Real>(margin)) / static_cast<Real>(size));
      extra += is_apart && answer && between > static_cast<Real>(margin) + kSlack * static_cast<Real>(size);
      apart += !answer;
    }
    CAPTURE(r);
    MESSAGE("regime " << r << ": " << apart << " apart, touching up to " << static_cast<double>(worst) << " beyond");
    CHECK(lost == 0);
    CHECK(extra == 0);
    CHECK(apart >= least_count(1000, kUsual));
  }
}

TEST_CASE("in double triangles whose edges pass each other at any angle are parted by any gap that is not rounding") {
  Random random(kSeed + 3);
  // In parts of the size, with errors of 2^-46 of it as surfaces have. The worst of 400 000 is 0.07 x 2^-40.
  constexpr Real kMostGap = 0x1p-42L;
  constexpr std::uint64_t kUsual = 20000;
  std::uint64_t apart = 0, wide = 0;
  for (std::uint64_t round = 0; round < rounds(kUsual); ++round) {
    double axis[3][3];
    random.rotation(axis);
    const double angle = random.log_uniform(1e-13, 1), gap = random.log_uniform(1e-13, 1e-3);
    const double widths[] = {0, random.log_uniform(1e-14, 1), 1};
    kernel::TriangleLanes<double> lanes[2];
    Triangle<Real> triangles[2];
    for (std::size_t s = 0; s < 2; ++s) {
      const double turn = s == 0 ? 0 : angle, up = s == 0 ? 0 : gap, width = widths[random.index(3)];
      const double from = -random.uniform(0.1, 1), to = random.uniform(0.1, 1), third = random.uniform(-1, 1);
      const oracle::Vec3<double> corners[] = {{{from, turn * from, up}},
                                              {{to, turn * to, up}},
                                              {{third, turn * third + random.uniform(-width, width),
                                                up + (s == 0 ? -width : width) * random.uniform(0, 1)}}};
      for (std::size_t k = 0; k < 3; ++k) {
        double at[3] = {};
        for (std::size_t y = 0; y < 3; ++y)
          for (std::size_t x = 0; x < 3; ++x) at[x] += corners[k][y] * axis[y][x];
        lanes[s].corner[(k + round) % 3] = {at[0], at[1], at[2]};
        triangles[s].corner[k] = {{at[0], at[1], at[2]}};
      }
    }
    const bool is_apart = !kernel::touch_in_double(lanes[0], lanes[1], 0x1p-45, 0);
    apart += is_apart;
    wide += !is_apart && oracle::distance_apart(triangles[0], triangles[1]) > kMostGap;
  }
  CHECK(wide == 0);
  CHECK(apart >= least_count(10000, kUsual));
}

TEST_CASE("in double a corner above the inside of a sliver is parted from it by any gap that is not rounding") {
  Random random(kSeed + 4);
  // In parts of the size, with errors of 2^-46 of it as surfaces have. The worst of 4 000 000 is 0.15 x 2^-40.
  constexpr double kMostGap = 0x1p-42;
  constexpr std::uint64_t kUsual = 20000;
  std::uint64_t apart = 0, wide = 0;
  double worst = 0;
  for (std::uint64_t round = 0; round < rounds(kUsual); ++round) {
    double axis[3][3];
    random.rotation(axis);
    // The sliver lies at height 0 along x. All of the other one is at least the margin and the gap above it, so that is
    // how far apart they are, whatever their shapes.
    const double width = random.log_uniform(1e-14, 1), gap = random.log_uniform(1e-13, 1e-3);
    const double margin = random.chance(0.5) ? 0 : random.log_uniform(1e-9, 0.3), up = margin + gap;
    const double from = -random.uniform(0.1, 1), to = random.uniform(0.1, 1), third = random.uniform(from, to);
    const double x = third * random.uniform(0, 0.5), y = width * random.uniform(0.1, 0.5);
    const double across = random.chance(0.5) ? 1 : random.log_uniform(1e-14, 1);
    oracle::Vec3<double> corners[2][3] = {{{{from, 0, 0}}, {{to, 0, 0}}, {{third, width, 0}}}, {{{x, y, up}}}};
    for (std::size_t k = 1; k < 3; ++k)
      corners[1][k] = {
          {x + random.uniform(-1, 1), y + across * random.uniform(-1, 1), up + random.log_uniform(1e-16, 1)}};
    kernel::TriangleLanes<double> lanes[2];
    for (std::size_t s = 0; s < 2; ++s)
      for (std::size_t k = 0; k < 3; ++k) {
        double at[3] = {};
        for (std::size_t i = 0; i < 3; ++i)
          for (std::size_t j = 0; j < 3; ++j) at[j] += corners[s][k][i] * axis[i][j];
        lanes[s].corner[(k + round) % 3] = {at[0], at[1], at[2]};
      }
    const std::size_t first = random.index(2);
    if (!kernel::touch_in_double(lanes[first], lanes[1 - first], 0x1p-45, margin)) {
      ++apart;
    } else {
      wide += gap > kMostGap;
      worst = std::max(worst, gap);
    }
  }
  MESSAGE(apart << " apart; the widest gap of the others is " << worst * 0x1p40 << " x 2^-40");
  CHECK(wide == 0);
  CHECK(apart >= least_count(10000, kUsual));
}

TEST_CASE("in double triangles that may touch by their error are not called apart") {
  Random random(kSeed + 2);
  constexpr std::uint64_t kUsual = 20000;
  std::uint64_t apart = 0, wrong = 0;
  for (std::uint64_t round = 0; round < rounds(kUsual); ++round) {
    TriangleBlock block{};
    put(draw_floats(random, static_cast<FloatRegime>(random.index(kFloatRegimeCount)), 1, 1), block, 0);
    const double error = random.log_uniform(1e-6, 0.3);
    if (touch(block, error, 0)) continue;
    ++apart;
    Triangle<Real> moved[2] = {triangle_of(block, 0, 0), triangle_of(block, 1, 0)};
    for (Triangle<Real>& triangle : moved)
      for (Point& corner : triangle.corner)
        for (std::size_t x = 0; x < 3; ++x) corner[x] += Real{0.5} * static_cast<Real>(error * random.sign());
    wrong += oracle::meet(moved[0], moved[1]);
  }
  CHECK(wrong == 0);
  CHECK(apart >= least_count(2000, kUsual));
}

}  // namespace cab::tests
