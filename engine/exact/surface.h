// Exact::kSurface: whether the triangles of two leaves touch.
#pragma once

#include "engine/exact/skin_cache.h"
#include "layout/convex_shape.h"

namespace cab {

// Whether a leaf stands for triangles.
inline bool has_triangles(const ExactLeaf& leaf) {
  const SurfaceLeaves& surface = leaf.batch->articulation->surface;
  return !surface.leaves.empty() && surface.leaves[leaf.leaf].patch_count > 0;
}

// Whether a triangle of one leaf touches one of the other, or comes within a margin of it. Both leaves have triangles.
// Pairs that not even doubles decide touch. Triangles of one instance that have a vertex in common do not count.
bool surfaces_touch(const FrameContext& frame, const ExactLeaf& a, const ExactLeaf& b, float margin, SkinCache& cache,
                    FrameStats& stats);

// Where the triangles of a skinned leaf may touch a convex shape: a box in world axes about the origin of the leaf's
// instance, and the margin of a triangle and the shape, which has room for rounding.
struct NearBox {
  float lo[3], hi[3];
  float margin;
};

// shift: the origin of the shape's instance less that of the leaf's. size: SkinnedLeaf::size.
NearBox near_box(const StoredPose& at, const ConvexShape& shape, const double (&shift)[3], float size, float margin);

}  // namespace cab
