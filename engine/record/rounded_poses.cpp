#include "engine/record/rounded_poses.h"

#include "layout/error_bounds.h"

#include <cab/record.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>

namespace cab::record {
namespace {

constexpr std::size_t kFloats = 7, kQuaternion = 4;
constexpr double kMost = 32767;

float from_step(std::int16_t step, std::size_t place, float length) {
  return place < kQuaternion ? static_cast<float>(step) / static_cast<float>(kMost) : static_cast<float>(step) * length;
}

// The nearest step, or false if it has more than 16 bits or the number is not finite.
bool to_step(double number, std::size_t place, float length, std::int16_t& step) {
  const double nearest = std::nearbyint(place < kQuaternion ? number * kMost : number / static_cast<double>(length));
  if (!(std::fabs(nearest) <= kMost)) return false;
  step = static_cast<std::int16_t>(nearest);
  return true;
}

bool same_bits(float a, float b) { return std::memcmp(&a, &b, sizeof a) == 0; }

bool round_pose(float* pose, float step) {
  double length = 0;
  for (std::size_t k = 0; k < kQuaternion; ++k) length += static_cast<double>(pose[k]) * static_cast<double>(pose[k]);
  length = std::sqrt(length);
  if (!(length > 0) || !std::isfinite(length)) return false;
  float rounded[kFloats];
  for (std::size_t k = 0; k < kFloats; ++k) {
    const double number = static_cast<double>(pose[k]) / (k < kQuaternion ? length : 1);
    std::int16_t steps = 0;
    if (!to_step(number, k, step, steps)) return false;
    rounded[k] = from_step(steps, k, step);
  }
  std::memcpy(pose, rounded, sizeof rounded);
  return true;
}

bool pose_to_steps(const float* pose, float step, std::int16_t* steps) {
  for (std::size_t k = 0; k < kFloats; ++k)
    if (!to_step(static_cast<double>(pose[k]), k, step, steps[k]) || !same_bits(from_step(steps[k], k, step), pose[k]))
      return false;
  return true;
}

// Whether the engine masks an instance for this pose, by the checks of its posing kernel.
bool is_masked(const float* pose) {
  const auto in_range = [](float number) { return std::fabs(number) <= kMaxCoordinate; };
  if (!std::all_of(pose, pose + kFloats, in_range)) return true;
  const float length_sq = (pose[0] * pose[0] + pose[1] * pose[1]) + (pose[2] * pose[2] + pose[3] * pose[3]);
  return length_sq < kQuaternionSqMin || length_sq > kQuaternionSqMax;
}

}  // namespace

bool is_step(float step) {
  if (step == 0) return true;
  int exponent = 0;
  return std::isfinite(step) && step > 0 && std::frexp(step, &exponent) == 0.5f && exponent > -60 && exponent < 62;
}

bool to_steps(const std::vector<float>& poses, float step, std::vector<std::int16_t>& steps) {
  steps.resize(poses.size());
  for (std::size_t i = 0; i < poses.size(); i += kFloats) {
    if (pose_to_steps(&poses[i], step, &steps[i])) continue;
    if (!is_masked(&poses[i])) return false;
    std::fill_n(&steps[i], kFloats, std::int16_t{0});
  }
  return true;
}

void from_steps(Span<const std::int16_t> steps, float step, std::vector<float>& poses) {
  poses.resize(steps.size);
  for (std::size_t i = 0; i < steps.size; ++i) poses[i] = from_step(steps[i], i % kFloats, step);
}

bool round_poses(Span<float> poses, float pose_step) noexcept {
  if (pose_step == 0 || !is_step(pose_step) || poses.size % kFloats != 0) return false;
  bool all = true;
  for (std::size_t i = 0; i < poses.size; i += kFloats) all = round_pose(poses.data + i, pose_step) && all;
  return all;
}

}  // namespace cab::record
