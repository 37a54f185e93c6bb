// A block of pairs of convex shapes: what the exact kernels take and answer.
#pragma once

#include "kernels/pose_leaves.h"
#include "layout/convex_shape.h"

namespace cab::kernel {

// One side of a block: a shape in each lane, and the poses that place it.
struct ConvexSide {
  PoseCoding coding;                 // of all lanes
  const ConvexShape* shape[kLanes];  // all of one kind
  const float* pose[kLanes];         // of the shape's link, in the caller's layout
  const float* orientation[kLanes];  // of the instance; all null if instances have none
  alignas(64) float scales[kLanes];  // of the instance, with Scaling::kPerInstance
};

// Sixteen pairs of shapes. Unused lanes repeat a used one.
struct ConvexBlock {
  ConvexSide a, b;
  ShiftTile shift;                        // the origin of b less the origin of a
  alignas(64) float scale[kLanes];        // a power of two by which lengths are multiplied, so that a pair has size 1
  alignas(64) float margin[kLanes] = {};  // see ConvexAnswer; 0 in all lanes or in none
  std::uint32_t count = kLanes;           // the lanes that are in use: the first ones
};

// The most directions from which the search for a depth starts.
inline constexpr std::uint32_t kMostStarts = 3;

// The contacts of the pairs of a block. Points are relative to the origin of a's instance, in world axes; lengths in
// the caller's unit.
struct alignas(64) ConvexContacts {
  double normal[3][kLanes];   // of length 1, from a to b
  double depth[kLanes];       // how far b must move along the normal to be free; below 0: minus a gap
  double point_a[3][kLanes];  // a point of a's shape
  double point_b[3][kLanes];  // a point of b's shape
};

// Which lanes of a block are decided. A lane in neither mask is undecided. `apart`: no point of a is within the margin
// of a point of b. `touching`: some points are.
struct ConvexAnswer {
  std::uint32_t apart = 0, touching = 0;
};

}  // namespace cab::kernel
