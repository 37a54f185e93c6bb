// How the poses of a batch are stored, and how they are scaled.
#pragma once

#include <cab/types.h>

namespace cab {

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
