// One tile: the posing and refit kernels, and which instances are masked.
#include "engine/step/update.h"

#include "engine/step/pose_scratch.h"
#include "kernels/pose_leaves.h"
#include "kernels/refit_tree.h"
#include "layout/compiler.h"

#include <algorithm>
#include <cmath>

namespace cab {
namespace {

// The instance that a lane poses: unused lanes repeat the last one.
std::uint32_t instance_in_lane(const TileInstances& instances, std::uint32_t lane) {
  return instances.instance[std::min(lane, instances.count - 1)];
}

// Whether a centre or half extent of a tile's link boxes is so large that a leaf box in them may exceed kMaxCoordinate.
bool is_near_limit(const BoxTile* boxes, std::uint32_t count) {
  constexpr float kNear = kMaxCoordinate / 16;
  bool out = false;
  for (std::uint32_t i = 0; i < count; ++i)
    for (std::uint32_t c = 0; c < 3; ++c)
      for (std::uint32_t lane = 0; lane < kLanes; ++lane)
        out |= !(std::fabs(boxes[i].center[c][lane]) < kNear) | !(boxes[i].half[c][lane] < kNear);
  return out;
}

// The arguments of the posing kernel for a tile. own: room for own boxes.
kernel::PoseTile pose_job(const FrameContext& frame, const TileUpdate& tile, PoseScratch& scratch, std::uint8_t* flags,
                          BoxTile& own) {
  const InstanceBatch& batch = *tile.batch;
  kernel::PoseTile pose = instances_to_pose(batch, tile.instances);
  for (std::uint32_t lane = 0; lane < kLanes; ++lane)
    pose.margins[lane] = grown_by(batch, instance_in_lane(tile.instances, lane), frame.margin);
  for (std::uint32_t lane = 0; lane < kLanes && is_static(batch); ++lane)
    set_lane(batch.own_boxes[instance_in_lane(tile.instances, lane)], lane, own);
  if (is_static(batch)) pose.own_boxes = &own;
  pose.leaves = tile.boxes;
  pose.joints = scratch.joints.data;
  pose.motions = frame.policies.refit == Refit::kAabbVertices ? scratch.motions.data : nullptr;
  pose.flags = flags;
  if (batch.by_states) pose.links = scratch.links.data;
  pose.skin = scratch.skin.data;
  pose.skin_rows = scratch.skin_rows.data;
  pose.grown = scratch.grown.data;
  pose.leaves_are_lanes = tile.scope == RefitScope::kLeavesAsLanes;
  const bool of_links = batch.active != batch.articulation;
  if (of_links) pose.range = kLinkRange * kMaxCoordinate;
  if (of_links || is_reach_lod(*batch.articulation)) pose.pads = kLinkPads;
  return pose;
}

// Masks instances by their leaves where link boxes were posed. Link boxes mask the same instances unless they are near
// kMaxCoordinate. Near it the leaves are posed into the same memory for their flags, and then the link boxes once more.
void mask_by_leaves(const FrameContext& frame, const InstanceBatch& batch, const kernel::PoseTile& pose) {
  if (batch.active == batch.articulation || !is_near_limit(pose.leaves, batch.active->leaf_count)) return;
  std::uint8_t flags[kLanes];
  kernel::PoseTile leaves = pose;
  leaves.articulation = batch.articulation;
  leaves.pads = 1;
  leaves.range = kMaxCoordinate;
  leaves.flags = flags;
  frame.kernels.pose_leaves(leaves);
  frame.kernels.pose_leaves(pose);
  std::copy(flags, flags + kLanes, pose.flags);
}

// Makes the nodes that tile.scope names from the posed leaf boxes, by the refit policy.
void refit(const FrameContext& frame, const TileUpdate& tile, const kernel::PoseTile& pose, PoseScratch& scratch) {
  const kernel::KernelTable& kernels = frame.kernels;
  const Articulation& articulation = *pose.articulation;
  const std::size_t extents = static_cast<std::size_t>(frame.policies.extents);
  const bool all = tile.scope == RefitScope::kAllNodes;
  if (frame.policies.refit == Refit::kAabbVertices && !is_static(*tile.batch) && articulation.skin.empty()) {
    const PosePad pad = kernel::pad_of(kernel::is_rotated(pose), 1);
    kernels.fit_vertices({&articulation, all ? articulation.node_count : articulation.leaf_count, scratch.motions.data,
                          tile.bounds, pad, pose.margins});
  } else if (is_axis_aligned(frame.policies.refit)) {
    kernels.bound_boxes(tile.boxes, articulation.leaf_count, tile.bounds);
    if (all) kernels.refit_aabbs[extents](articulation.program, tile.bounds);
  } else if (all) {
    kernels.refit_boxes[static_cast<std::size_t>(frame.policies.refit)][extents](
        {&articulation.program, scratch.joints.data, tile.boxes});
  }
}

// Moves the nodes of a level to the front, out of those of the articulation that was refitted. None is overwritten
// before it is moved: each is at the index of its node there or before.
void keep_lod(const FrameContext& frame, const TileUpdate& tile) {
  const Span<const std::uint16_t> nodes = tile.batch->active->lod.node;
  for (std::size_t n = 0; n < nodes.size; ++n) {
    if (is_axis_aligned(frame.policies.refit))
      tile.bounds[n] = tile.bounds[nodes[n]];
    else
      tile.boxes[n] = tile.boxes[nodes[n]];
  }
}

// Which boxes decide the flags: those that were posed, leaves or link boxes, or always the leaves.
enum class FlagsOf : std::uint8_t { kPosedBoxes, kLeaves };

// Poses the leaf boxes of a tile and makes the nodes that tile.scope names. Writes the flags of each lane, and returns
// the bits of the lanes whose instances are not masked.
std::uint32_t pose_and_refit(const FrameContext& frame, const TileUpdate& tile, PoseScratch& scratch,
                             std::uint8_t (&flags)[kLanes], FlagsOf flags_of) {
  BoxTile own;
  const kernel::PoseTile pose = pose_job(frame, tile, scratch, flags, own);
  frame.kernels.pose_leaves(pose);
  if (flags_of == FlagsOf::kLeaves) mask_by_leaves(frame, *tile.batch, pose);
  if (tile.scope != RefitScope::kNone && !pose.leaves_are_lanes) refit(frame, tile, pose, scratch);
  if (tile.scope == RefitScope::kAllNodes) keep_lod(frame, tile);
  std::uint32_t out = 0;
  for (std::uint32_t lane = 0; lane < tile.instances.count; ++lane)
    if (flags[lane] == kInstanceOk) out |= 1u << lane;
  return out;
}

}  // namespace

kernel::PoseTile instances_to_pose(const InstanceBatch& batch, const TileInstances& instances) {
  kernel::PoseTile pose;
  pose.articulation = &posed_articulation(*batch.active);
  pose.coding = coding_of(batch);
  pose.link_stride = batch.link_stride / sizeof(float);
  pose.count = instances.count;
  for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
    const std::uint32_t instance = instance_in_lane(instances, lane);
    pose.poses[lane] = pose_of(batch, instance);
    pose.orientations[lane] = orientation_of(batch, instance);
    pose.scales[lane] = scale_of(batch, instance);
  }
  return pose;
}

TileInstances instances_of(const InstanceBatch& batch, std::uint32_t tile) {
  TileInstances out;
  out.count = std::min(kLanes, active_count(batch) - tile * kLanes);
  for (std::uint32_t lane = 0; lane < out.count; ++lane)
    out.instance[lane] = active_instance(batch, tile * kLanes + lane);
  return out;
}

void prefetch_pose(const InstanceBatch& batch, std::uint32_t instance) {
  prefetch_bytes(pose_of(batch, instance), prefetched_bytes(batch));
}

std::uint32_t update_tile(const FrameContext& frame, const TileUpdate& tile, PoseScratch& scratch) {
  std::uint8_t flags[kLanes];
  return pose_and_refit(frame, tile, scratch, flags, FlagsOf::kPosedBoxes);
}

std::uint32_t update_and_flag_tile(const FrameContext& frame, const TileUpdate& tile, PoseScratch& scratch,
                                   FrameStats& stats) {
  std::uint8_t flags[kLanes];
  const std::uint32_t out = pose_and_refit(frame, tile, scratch, flags, FlagsOf::kLeaves);
  const TileInstances& instances = tile.instances;
  const Span<std::uint8_t> reported = tile.batch->input->flags;
  if (!reported.empty())
    for (std::uint32_t lane = 0; lane < instances.count; ++lane) reported[instances.instance[lane]] = flags[lane];
  stats.instances_masked += instances.count - count_bits(out);
  return out;
}

}  // namespace cab
