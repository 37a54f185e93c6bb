// The least surface of a box about others that the search finds, against known ones and against other orientations.
#include "perf/judge/oracle/rotation_limit.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <vector>

#include "perf/judge/oracle/random.h"

namespace cab::tests {
namespace {

using oracle::OracleBox;

OracleBox<double> rotated_box(oracle::Random& random, double x, double y, double z) {
  OracleBox<double> box{{1, 2, 3}, {}, {x, y, z}};
  random.rotation(box.axis);
  return box;
}

}  // namespace

TEST_CASE("the rotation limit is a rotated box's own surface, and no orientation that is tried is below it") {
  constexpr double kTolerance = 1e-3;  // the worst measured difference from known limits is below 1e-6
  oracle::Random random(3);
  for (int k = 0; k < 20; ++k) {
    CAPTURE(k);
    const double x = random.uniform(.1, 1), y = random.uniform(.1, 1), z = random.uniform(.01, 1);
    const OracleBox<double> box = rotated_box(random, x, y, z);
    CHECK(oracle::rotation_limit({box}) == doctest::Approx(oracle::surface_of(box.half)).epsilon(1e-6));
    // Its eight octants, each with another order of axes. The search starts from these too.
    std::vector<OracleBox<double>> octants;
    for (unsigned c = 0; c < 8; ++c) {
      OracleBox<double> octant = box;
      const oracle::Vec3<double> center = .5 * (oracle::corner(box, c) + oracle::center_of(box));
      oracle::store(center, octant.center);
      for (double& half : octant.half) half /= 2;
      octants.push_back(octant);
    }
    CHECK(oracle::rotation_limit(octants) == doctest::Approx(oracle::surface_of(box.half)).epsilon(1e-6));
    std::vector<OracleBox<double>> any;
    for (int b = 0; b < 5; ++b) {
      any.push_back(rotated_box(random, x, y, z));
      for (double& c : any.back().center) c = random.uniform(-1, 1);
    }
    const double limit = oracle::rotation_limit(any);
    for (int t = 0; t < 3000; ++t) {
      double axis[3][3];
      random.rotation(axis);
      OracleBox<double> about{};
      for (std::size_t a = 0; a < 3; ++a) {
        double low = 1e9, high = -1e9;
        for (const OracleBox<double>& b : any)
          for (unsigned c = 0; c < 8; ++c) {
            const double at = oracle::dot(oracle::to_vec3(axis[a]), oracle::corner(b, c));
            low = std::min(low, at);
            high = std::max(high, at);
          }
        about.half[a] = (high - low) / 2;
      }
      if (oracle::surface_of(about.half) < (1 - kTolerance) * limit) FAIL_CHECK("orientation ", t, " is better");
    }
  }
}

}  // namespace cab::tests
