// Which segments of a skeleton are bones: measured over all poses.
#pragma once

#include "scenes/vec3d.h"

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace cab::scenes {

// A skeleton in one or more poses. Borrows all arrays. Every joint comes after its parent.
struct SkeletonView {
  const std::vector<std::string>& names;     // [joint]; names may be empty
  const std::vector<std::int32_t>& parents;  // [joint]; -1 for joint 0 and any other root
  const std::vector<bool>& is_end_site;      // [joint] it only marks the end of its parent's bone
  const std::vector<double>& rest_offsets;   // [joint][3] in the parent's frame
  const std::vector<double>& rotations;      // [frame][joint][4] quaternion x y z w to the model
  const std::vector<double>& positions;      // [frame][joint][3] in the model
  std::uint32_t frame_count = 0;
};

Vec3 position(const SkeletonView& skeleton, std::size_t frame, std::size_t joint);
Quat rotation(const SkeletonView& skeleton, std::size_t frame, std::size_t joint);

// The joint above, or joint 0 above other roots.
std::size_t parent_of(const SkeletonView& skeleton, std::size_t joint);

// The place of a joint, which is not joint 0, in the frame of the joint above.
Vec3 local_offset(const SkeletonView& skeleton, std::size_t frame, std::size_t joint);

// The segment from its parent to a joint.
enum class SegmentKind {
  kBone,       // between two joints of the figure
  kZero,       // the joint has the place of its parent
  kTravels,    // the joint moves in its parent's frame, so the segment is no bone
  kOutside,    // it leads from or to a node that is no part of the body
  kOtherRoot,  // the joint is a root
};

struct Segments {
  std::vector<SegmentKind> kind;       // [joint]; joint 0 is kOtherRoot
  std::vector<Vec3> offset;            // [joint] in the parent's frame: at rest, or the mean where the motion differs
  std::vector<double> strays;          // [joint] greatest distance from the mean offset; 0 at the rest offset
  std::vector<std::size_t> point;      // [joint] the first joint of its point: joints of one point are never apart
  std::array<double, 3> extents = {};  // of the figure along each axis, the median over all frames
  double height = 0;                   // the greatest of the extents
};

Segments measure_segments(const SkeletonView& skeleton);

}  // namespace cab::scenes
