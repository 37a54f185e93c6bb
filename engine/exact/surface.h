// Exact::kSurface: whether the triangles of two leaves touch.
#pragma once

#include "engine/exact/convex_pair.h"
#include "engine/exact/skin_cache.h"
#include "kernels/surface/part_triangles.h"

namespace cab {

// Whether a leaf stands for triangles.
inline bool has_triangles(const ExactLeaf& leaf) {
  const SurfaceLeaves& surface = leaf.batch->articulation->surface;
  return !surface.leaves.empty() && surface.leaves[leaf.leaf].patch_count > 0;
}

// The patches of a leaf that has triangles.
inline const TrianglePatch* patches_of(const ExactLeaf& leaf) {
  const SurfaceLeaves& surface = leaf.batch->articulation->surface;
  return surface.patches.data + surface.leaves[leaf.leaf].patch_begin;
}

// The poses of an instance's links in double. Those of the first few that are asked for are computed once: corners of a
// triangle are mostly moved by the same links.
class LinkPoses {
 public:
  explicit LinkPoses(const ExactLeaf& leaf) : leaf_(leaf) {}

  // The answer stays as it is until the next one.
  const kernel::RigidLanes<double>& at(std::uint32_t link) {
    std::uint32_t i = 0;
    while (i < count_ && links_[i] != link) ++i;
    if (i == count_) {
      if (count_ < kKept) ++count_;
      i = count_ - 1;
      links_[i] = link;
      poses_[i] = pose_in_double(stored_pose(*leaf_.batch, leaf_.instance, link));
    }
    return poses_[i];
  }

 private:
  static constexpr std::uint32_t kKept = 8;
  const ExactLeaf& leaf_;
  std::uint32_t count_ = 0, links_[kKept];
  kernel::RigidLanes<double> poses_[kKept];
};

// Where a vertex of a skin is, about the origin of its instance. size: becomes at least as large as the numbers on the
// way.
Double3 skinned_vertex(const ExactLeaf& leaf, std::uint32_t vertex, LinkPoses& poses, double& size);

// A triangle in double, and how large numbers were on the way to its corners.
struct PlacedTriangle {
  kernel::TriangleLanes<double> at;
  double size;
};

// A triangle of a leaf: kLanes times its patch, and its lane. Its corners are about the origin of its instance, plus
// the shift.
PlacedTriangle triangle_in_double(const ExactLeaf& leaf, std::uint32_t triangle, const double (&shift)[3]);

// Takes two triangles that touch: their indices in Leaf::triangles, over 3. Returns whether to go on.
using TakeTouching = bool (*)(void* taker, std::uint32_t a, std::uint32_t b);

// Finds the triangles of one leaf that touch triangles of the other, or come within a margin of them, in no certain
// order. Both leaves have triangles. Pairs that not even doubles decide touch. Triangles of one instance that have a
// vertex in common do not count.
void find_touching_triangles(const FrameContext& frame, const ExactLeaf& a, const ExactLeaf& b, float margin,
                             SkinCache& cache, FrameStats& stats, void* taker, TakeTouching take);

// Whether there are any.
bool surfaces_touch(const FrameContext& frame, const ExactLeaf& a, const ExactLeaf& b, float margin, SkinCache& cache,
                    FrameStats& stats);

// Whether a shape is a triangle.
inline bool is_triangle(const ConvexShape& shape) {
  return shape.kind == ConvexKind::kHull && shape.part->vertices.size == 9;
}

// Whether a triangle of a skinned leaf touches a shape that is a triangle, or comes within the margin of it. Triangles
// that not even doubles decide touch. shift: the origin of the shape's instance less that of the leaf's.
bool touch_triangle(const FrameContext& frame, const ExactLeaf& leaf, const kernel::SkinnedLeaf& skin,
                    const PlacedShape& triangle, const double (&shift)[3], float margin);

// A convex shape as the triangles of a skinned leaf meet it, and the box in world axes about the origin of the leaf's
// instance in which they may touch it. The margin of the part has room for rounding.
struct NearPart {
  kernel::SurfacePart part;
  float lo[3], hi[3];
};

NearPart near_part(const PlacedShape& placed, const double (&shift)[3], const ExactLeaf& leaf,
                   const kernel::SkinnedLeaf& skin, float margin);

}  // namespace cab
