// The bounds of characters in the world.
#pragma once

#include "engine/step/candidate.h"
#include "engine/step/frame_context.h"

namespace cab {

// Whether two bounds overlap or touch.
inline bool overlap(const InstanceBounds& a, const InstanceBounds& b) {
  return (a.lo[0] <= b.hi[0]) & (b.lo[0] <= a.hi[0]) & (a.lo[1] <= b.hi[1]) & (b.lo[1] <= a.hi[1]) &
         (a.lo[2] <= b.hi[2]) & (b.lo[2] <= a.hi[2]);
}

// The bounds of an instance in the world: its origin plus `all`, the bounds of its leaf boxes relative to the origin in
// one lane of a tile, widened by the rounding of these sums.
InstanceBounds world_bounds(const InstanceBatch& batch, std::uint32_t instance, const AabbTile& all,
                            std::uint32_t lane);

// Stores the world bounds of a tile's instances. leaves: bounds of their leaf boxes relative to their origins.
void bound_instances(const kernel::KernelTable& kernels, InstanceBatch& batch, const TileInstances& instances,
                     const AabbTile* leaves);

// The same for few instances. leaves: tiles of leaves as lanes (kFewInstances).
void bound_few_instances(const kernel::KernelTable& kernels, InstanceBatch& batch, const TileInstances& instances,
                         const AabbTile* leaves);

// The world bounds of an instance by the bounds that the caller gives for it. They hold those of bound_instances with a
// margin, if the caller's hold the leaf boxes of compute_boxes.
InstanceBounds given_bounds(const InstanceBatch& batch, std::uint32_t instance, float margin);

}  // namespace cab
