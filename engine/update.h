// Steps 1 and 3 of a frame, for one tile: posing and refit.
#pragma once

#include "engine/engine.h"

namespace cab {

// Poses the leaves of one tile of a bound batch into nodes and refits the inner nodes; with an axis-aligned refit
// the hierarchy is left in aabbs instead (nodes then holds the leaf boxes only). Returns the bits of the instances that
// take part. report: writes the instances' flags where the caller wants them and counts the masked ones; false where
// another task does so for the same tile. margin: that of the frame, for which leaf boxes grow.
std::uint32_t update_tile(const Engine& engine, const InstanceBatch& batch, const Policies& policies, float margin,
                          std::uint32_t tile, bool report, Worker& worker, BoxTile* nodes, AabbTile* aabbs);

}  // namespace cab
