// Poses the leaf boxes of one tile, and refits its hierarchies.
#pragma once

#include "engine/step/candidate.h"
#include "engine/step/frame_context.h"
#include "kernels/pose_leaves.h"

namespace cab {

struct PoseScratch;

// How much of a hierarchy the refit policy makes from the posed leaf boxes. kNone: nothing. kLeaves: the leaves as the
// policy keeps them, as boxes or as axis-aligned bounds. kAllNodes: all nodes. kLeavesAsLanes: the leaf boxes of few
// instances with a skin, in tiles of leaves as lanes (kFewInstances).
enum class RefitScope : std::uint8_t { kNone, kLeaves, kAllNodes, kLeavesAsLanes };

// What a strategy tests. The leaves of a level of nodes are inner nodes.
inline RefitScope refit_scope(Strategy strategy, const Articulation& articulation) {
  return strategy == Strategy::kTree || articulation.lod.posed ? RefitScope::kAllNodes : RefitScope::kLeaves;
}

// Whether boxes of a batch that are kept (BoundInput::keeps_boxes) are in tiles of leaves as lanes.
inline bool keeps_leaves_as_lanes(const InstanceBatch& batch, Refit refit) {
  const std::uint32_t count = active_count(batch), leaves = batch.active->leaf_count;
  return batch.keeps_boxes && batch.active == batch.articulation && !is_axis_aligned(refit) && count <= kFewInstances &&
         count * tile_count(leaves) <= leaves;
}

// One tile to update, and where its nodes go. Of a level of nodes, kLeaves makes the leaves of its articulation, and
// kAllNodes the nodes of the level. An axis-aligned refit writes the nodes to `bounds`, and `boxes` receives
// the posed leaf boxes alone.
struct TileUpdate {
  const InstanceBatch* batch;  // bound to an input
  TileInstances instances;
  RefitScope scope;
  BoxTile* boxes;    // by node of the active articulation
  AabbTile* bounds;  // likewise
};

// Returns the instances of a tile of a batch: up to sixteen of those that are given, in order.
TileInstances instances_of(const InstanceBatch& batch, std::uint32_t tile);

// The arguments of the posing kernel that place the instances of a tile; the others are the caller's to set.
kernel::PoseTile instances_to_pose(const InstanceBatch& batch, const TileInstances& instances);

// How much of an instance's pose is prefetched.
inline std::size_t prefetched_bytes(const InstanceBatch& batch) {
  constexpr std::size_t kMost = 2048;
  return std::min(batch.articulation->link_count * batch.link_stride, kMost);
}

// Prefetches the pose of an instance that is posed soon.
void prefetch_pose(const InstanceBatch& batch, std::uint32_t instance);

// Poses the leaf boxes of a tile, padded for rounding and for the frame's margin, and refits what tile.scope names.
// Returns the bits of the lanes whose pose is valid.
std::uint32_t update_tile(const FrameContext& frame, const TileUpdate& tile, PoseScratch& scratch);

// The same for instances that were not posed in this call before: decides which of them are masked, writes the caller's
// flags, if any, and counts the masked instances.
std::uint32_t update_and_flag_tile(const FrameContext& frame, const TileUpdate& tile, PoseScratch& scratch,
                                   FrameStats& stats);

}  // namespace cab
