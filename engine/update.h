// Steps 1 and 3 of a frame, for one tile: posing and refit.
#pragma once

#include "engine/engine.h"

namespace cab {

// Tile `tile` of a batch: the instances that follow each other in it.
TileInstances instances_of(const InstanceBatch& batch, std::uint32_t tile);

// Starts reading an instance's pose, to be posed soon.
void prefetch_pose(const InstanceBatch& batch, std::uint32_t instance);

// Poses the leaves of a tile of a bound batch into nodes and, for the strategies that descend, refits the inner nodes;
// with an axis-aligned refit the hierarchy is left in aabbs instead (nodes then holds the leaf boxes only). Returns the
// bits of the instances that take part. report: writes the instances' flags where the caller wants them and counts the
// masked ones; false where that was done already. margin: that of the frame, for which leaf boxes grow.
std::uint32_t update_tile(const Engine& engine, const InstanceBatch& batch, const Policies& policies, float margin,
                          const TileInstances& tile, bool report, Worker& worker, BoxTile* nodes, AabbTile* aabbs);

}  // namespace cab
