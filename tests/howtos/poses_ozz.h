// Poses of ozz-animation: what LocalToModelJob writes is handed over as it is.
#pragma once

#include <cab/cab.h>

#include <cstdint>
#include <vector>

namespace as_in_ozz {

// Like ozz::math::Float4x4: four columns, the translation in the last.
struct alignas(16) Float4x4 {
  float cols[4][4];
};

// quote
// LocalToModelJob::output of all characters, one after the other. No number is copied.
inline cab::PoseView poses_of(const Float4x4* models) {
  cab::PoseView poses;
  poses.format = cab::PoseFormat::kMatrix4x4Columns;
  poses.data = reinterpret_cast<const float*>(models);
  poses.has_scale = true;  // joints may have a scale, the same along all axes
  return poses;
}

// The same where each character is a structure of the game that holds its matrices.
struct Character {
  double place[3];
  Float4x4 models[4];
};
inline cab::PoseView poses_of(const Character* characters) {
  cab::PoseView poses = poses_of(characters->models);
  poses.instance_stride = sizeof(Character);
  return poses;
}
// end quote

// Skeleton::joint_parents(): parents come before their children already.
inline std::vector<std::int32_t> parents_of(cab::Span<const std::int16_t> joint_parents) {
  return {joint_parents.begin(), joint_parents.end()};
}

}  // namespace as_in_ozz
