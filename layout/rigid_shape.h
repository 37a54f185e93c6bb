// The leaf boxes of an articulation as the crowd's kernels read them: as tables of sixteen leaves, and as records.
#pragma once

#include "layout/box_aos.h"
#include "layout/tile.h"

namespace cab {

// A leaf's box by the axes of its own: where its centre is along them, seen from its link's origin; its half extents
// with the frame's margin; the quaternion x y z w that turns the link's axes into the box's.
struct alignas(16) RigidLeaf {
  float middle[3];
  float half[3];
  float unused[2];
  float turn[4];
};
static_assert(sizeof(RigidLeaf) == 48);

// Sixteen leaves that follow each other. reach: how much the bounds of a leaf exceed those of its box, besides what
// depends on its place (docs/proof.md, step 14.2). offset: floats from the pose of the first link to that of the
// leaf's.
struct alignas(64) RigidBlock {
  float middle[3][kLanes];
  float half[3][kLanes];
  float turn[4][kLanes];
  float reach[kLanes];
  std::uint32_t offset[kLanes];
  std::uint32_t leaves;  // how many are there
};

// All leaves of a batch's articulation, for the poses and the margin of one frame. exact: the boxes as pose_box reads
// them, in the link's frame, with the padding that does not depend on the pose in BoxAos::unused.
struct RigidShape {
  const RigidBlock* block = nullptr;      // leaf n is in block n / 16
  const RigidLeaf* leaf = nullptr;        // by leaf
  const BoxAos* exact = nullptr;          // by leaf
  const std::uint32_t* offset = nullptr;  // by leaf: RigidBlock::offset
  // Links without leaves whose pose is checked all the same, as pose_leaves does: offset of each.
  const std::uint32_t* bare = nullptr;
  std::uint32_t bare_count = 0;
  bool turned = false;  // whether a box has other axes than its link
  // Whether instances have orientations, scales or margins of their own: then half extents are without a margin, and
  // `reach` is without its constant part. extent: the largest S + |c|_1 of a leaf, without a margin, or |j|_1 of a
  // joint.
  bool placed = false;
  float extent = 0;
};

}  // namespace cab
