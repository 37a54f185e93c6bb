// Steps 1 and 3 of a frame, for one tile: posing and refit.
#pragma once

#include "engine/candidate.h"
#include "engine/frame_context.h"

namespace cab {

struct Worker;

// What of a hierarchy is made: the posed leaf boxes as they are, the leaves as the refit policy keeps them, or all nodes.
enum class Nodes : std::uint8_t { kPosed, kLeaves, kAll };

// Nodes that a strategy tests.
inline Nodes nodes_tested(Strategy strategy) {
  return strategy == Strategy::kExactAll ? Nodes::kPosed : strategy == Strategy::kTree ? Nodes::kAll : Nodes::kLeaves;
}

// One tile to update: which instances of a bound batch, how much of their hierarchies, and where the boxes go. With an
// axis-aligned refit the hierarchy is left in `bounds`, and `boxes` holds the leaf boxes only.
struct TileUpdate {
  const InstanceBatch* batch;
  TileInstances instances;
  Nodes nodes;
  BoxTile* boxes;
  AabbTile* bounds;
};

// The instances of tile `tile` of a batch.
TileInstances instances_of(const InstanceBatch& batch, std::uint32_t tile);

// Starts reading an instance's pose, to be posed soon.
void prefetch_pose(const InstanceBatch& batch, std::uint32_t instance);

// Poses the leaves of a tile, with padding for the frame's margin, and refits inner nodes where they are asked for.
// Returns the bits of the lanes whose pose is valid.
std::uint32_t update_tile(const FrameContext& frame, const TileUpdate& tile, Worker& worker);

// The same for instances that this frame has not posed before: which of them are masked is decided here. Writes their
// flags where the caller wants them, and counts the masked ones.
std::uint32_t update_and_report_tile(const FrameContext& frame, const TileUpdate& tile, Worker& worker);

}  // namespace cab
