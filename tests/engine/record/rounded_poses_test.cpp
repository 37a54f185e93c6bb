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

constexpr float kInfinite = std::numeric_limits<float>::infinity(), kNan = std::numeric_limits<float>::quiet_NaN();

TEST_CASE("a pose that is none has steps of 0 where 16 bits do not hold it") {
  const std::vector<float> sound = {0, 0, 0, 1, 1, 2, 3};
  const std::vector<std::vector<float>> no_poses = {
      {0, kNan, 0, 1, 1, 2, 3},  {0, 0, 0, kInfinite, 1, 2, 3}, {0, 0, 0, 1, 1, kNan, 3}, {0, 0, 0, 1, 1, 2, 2e18f},
      {0, 0, 0, 0, 1.25f, 2, 3}, {0, 0, 0, 5e-4f, 1, 2, 3},     {0, 0, 2e3f, 0, 1, 2, 3}};
  std::vector<std::int16_t> steps;
  for (const std::vector<float>& pose : no_poses) {
    std::vector<float> three = sound;
    three.insert(three.end(), pose.begin(), pose.end());
    three.insert(three.end(), sound.begin(), sound.end());
    REQUIRE(to_steps(three, 1, steps));
    CHECK(steps == std::vector<std::int16_t>{0, 0, 0, 32767, 1, 2, 3, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 32767, 1, 2, 3});
  }
  REQUIRE(to_steps({0, 0, 0, 0, 1, 2, 3}, 1, steps));
  CHECK(steps == std::vector<std::int16_t>{0, 0, 0, 0, 1, 2, 3});
  const std::vector<std::vector<float>> poses = {
      {0, 0, 0, 1, 1, 2, 1e18f}, {0, 0, 0, 2e-3f, 1, 2, 3}, {0, 0, 0, 9e2f, 1, 2, 3}, {0, 0, 0, 1, 1.25f, 2, 3}};
  for (const std::vector<float>& pose : poses) CHECK_FALSE(to_steps(pose, 1, steps));
}

TEST_CASE("what 16 bits do not hold is not rounded") {
  const std::vector<std::vector<float>> poses = {{0, 0, 0, 0, 1, 2, 3},         {0, kNan, 0, 1, 1, 2, 3},
                                                 {0, kInfinite, 0, 1, 1, 2, 3}, {0, 0, 0, 1, 32768, 2, 3},
                                                 {0, 0, 0, 1, 1, -32768, 3},    {0, 0, 0, 1, 1, 2, kNan}};
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
  CHECK_FALSE(is_step(kNan));
  CHECK(is_step(0));
  CHECK(is_step(0.0009765625f));
}

}  // namespace
}  // namespace cab::tests
