// How the poses of a batch are stored, and how they are scaled.
#pragma once

#include <cab/types.h>

#include <cstddef>
#include <cstdint>

namespace cab {

// Floats of the pose of one link.
inline constexpr std::uint32_t pose_floats(PoseFormat format) {
  return format == PoseFormat::kQuaternionTranslation ? 7u : format == PoseFormat::kMatrix3x4Rows ? 12u : 16u;
}

// Bytes from the pose of one link to that of the next, and from one instance to the next: what 0 stands for is known.
inline std::size_t link_bytes(const PoseView& poses) {
  return poses.link_stride != 0 ? poses.link_stride : pose_floats(poses.format) * sizeof(float);
}
inline std::size_t instance_bytes(const PoseView& poses, std::size_t link_count) {
  return poses.instance_stride != 0 ? poses.instance_stride : link_count * link_bytes(poses);
}

// Where the scale of a pose comes from.
enum class Scaling : std::uint8_t {
  kNone,         // nothing is scaled
  kPerInstance,  // BatchInput::scales: one factor for all links of an instance
  kInMatrices,   // PoseView::has_scale: the matrix of a link holds the factor of this link
};

struct PoseCoding {
  PoseFormat format = PoseFormat::kQuaternionTranslation;
  Scaling scaling = Scaling::kNone;
};

// The pose of one link of one instance, in the caller's layout.
struct StoredPose {
  PoseCoding coding;
  const float* pose;
  const float* orientation;  // of the instance; null if the caller gave none
  float scale;               // of the instance, with Scaling::kPerInstance
};

inline bool operator==(const PoseCoding& a, const PoseCoding& b) {
  return a.format == b.format && a.scaling == b.scaling;
}

// The coding of poses without a factor per instance.
inline PoseCoding coding_of(const PoseView& poses) {
  return {poses.format, poses.has_scale ? Scaling::kInMatrices : Scaling::kNone};
}

}  // namespace cab
