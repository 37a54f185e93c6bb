// Poses in 16 bits per number.
#include "engine/record/rounded_poses.h"

#include <cab/record.h>
#include <doctest/doctest.h>

#include <cmath>
#include <limits>

#include "perf/harness/random_rig.h"
#include "tests/rounds.h"

namespace cab::tests {
namespace {

using namespace cab::record;

TEST_CASE("rounded poses are near, and survive the way to steps and back bit for bit") {
  oracle::Random random(731);
  for (std::uint64_t round = 0; round < rounds(2000); ++round) {
    const float step = std::ldexp(1.0f, static_cast<int>(random.index(20)) - 10);
    double q[4];
    oracle::random_turn(random, q);
    const double length = random.log_uniform(0.01, 100);
    std::vector<float> pose;
    for (const double x : q) pose.push_back(static_cast<float>(x * length));
    for (int c = 0; c < 3; ++c)
      pose.push_back(static_cast<float>(random.uniform(-30000, 30000) * static_cast<double>(step)));
    std::vector<float> rounded = pose;
    REQUIRE(round_poses(rounded, step));
    for (std::size_t k = 0; k < 4; ++k) CHECK(std::fabs(static_cast<double>(rounded[k]) - q[k]) < 0.6 / 32767);
    for (std::size_t k = 4; k < 7; ++k)
      CHECK(std::fabs(static_cast<double>(rounded[k]) - static_cast<double>(pose[k])) <= static_cast<double>(step) / 2);
    std::vector<std::int16_t> steps;
    REQUIRE(to_steps(rounded, step, steps));
    std::vector<float> back;
    from_steps(steps, step, back);
    CHECK(back == rounded);
    rounded[4] = std::nextafter(rounded[4], 1e9f);
    CHECK_FALSE(to_steps(rounded, step, steps));
  }
}

TEST_CASE("what 16 bits do not hold is not rounded") {
  const float infinite = std::numeric_limits<float>::infinity(), nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<std::vector<float>> poses = {{0, 0, 0, 0, 1, 2, 3},        {0, nan, 0, 1, 1, 2, 3},
                                                 {0, infinite, 0, 1, 1, 2, 3}, {0, 0, 0, 1, 32768, 2, 3},
                                                 {0, 0, 0, 1, 1, -32768, 3},   {0, 0, 0, 1, 1, 2, nan}};
  for (std::vector<float> pose : poses) {
    const std::vector<float> before = pose;
    CHECK_FALSE(round_poses(pose, 1));
    CHECK(pose[5] == before[5]);
  }
  std::vector<float> two = {0, 0, 0, 0, 1, 2, 3, 0, 0, 0, 2, 1.25f, 2, 3};
  CHECK_FALSE(round_poses(two, 1));
  CHECK(two[10] == 1);  // the others are rounded
  CHECK(two[11] == 1);
  CHECK_FALSE(round_poses(two, 0.3f));
  CHECK_FALSE(is_step(-1));
  CHECK_FALSE(is_step(nan));
  CHECK(is_step(0));
  CHECK(is_step(0.0009765625f));
}

}  // namespace
}  // namespace cab::tests
