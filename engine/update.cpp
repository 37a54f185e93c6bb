#include "engine/update.h"

#include "kernels/pose_leaves.h"
#include "kernels/refit_tree.h"

#include <algorithm>
#include <cmath>

namespace cab {

namespace {

// Steps after posing: inner boxes, or bounds of every node, by the refit policy.
void refit(const kernel::KernelTable& kernels, const Articulation& articulation, const Policies& policies, bool rotated,
           float margin, Worker& worker, BoxTile* nodes, AabbTile* aabbs) {
  const std::size_t extents = static_cast<std::size_t>(policies.extents);
  const bool tree = policies.strategy == Strategy::kTree;
  if (policies.refit == Refit::kAabbVertices) {
    const PosePad pad = kernel::pad_of(rotated, margin, 1);
    kernels.fit_vertices(
        {&articulation, tree ? articulation.node_count : articulation.leaf_count, worker.motions.data, aabbs, pad});
  } else if (policies.refit == Refit::kAabbHull) {
    kernels.bound_boxes(nodes, articulation.leaf_count, aabbs);
    if (tree) kernels.refit_aabbs[extents](articulation.program, aabbs);
  } else if (tree) {
    kernels.refit_boxes[static_cast<std::size_t>(policies.refit)][extents](
        {&articulation.program, worker.joints.data, nodes, worker.moments.data});
  }
}

// Whether a number of a tile's boxes is so large that one of a leaf in them may be too large.
bool is_near_limit(const BoxTile* boxes, std::uint32_t count) {
  constexpr float kNear = kMaxCoordinate / 16;
  bool out = false;
  for (std::uint32_t i = 0; i < count; ++i)
    for (std::uint32_t c = 0; c < 3; ++c)
      for (std::uint32_t lane = 0; lane < kLanes; ++lane)
        out |= !(std::fabs(boxes[i].center[c][lane]) < kNear) | !(boxes[i].half[c][lane] < kNear);
  return out;
}

// Poses the boxes that are tested. Which instances are masked is decided by the leaves, whatever is active: link boxes
// tell as long as they are far from the limit.
void pose_leaves(const Engine& engine, const InstanceBatch& batch, bool report, kernel::PoseTile& pose) {
  if (batch.active == batch.articulation) return engine.kernels->pose_leaves(pose);
  pose.pads = kLinkPads;
  pose.range = kLinkRange * kMaxCoordinate;
  engine.kernels->pose_leaves(pose);
  if (!report || !is_near_limit(pose.leaves, batch.active->leaf_count)) return;
  std::uint8_t flags[kLanes];
  kernel::PoseTile leaves = pose;
  leaves.articulation = batch.articulation;
  leaves.pads = 1;
  leaves.range = kMaxCoordinate;
  leaves.flags = flags;
  engine.kernels->pose_leaves(leaves);
  engine.kernels->pose_leaves(pose);
  std::copy(flags, flags + kLanes, pose.flags);
}

}  // namespace

TileInstances instances_of(const InstanceBatch& batch, std::uint32_t tile) {
  TileInstances out;
  out.count = std::min(kLanes, batch.instance_count - tile * kLanes);
  for (std::uint32_t lane = 0; lane < out.count; ++lane) out.instance[lane] = tile * kLanes + lane;
  return out;
}

void prefetch_pose(const InstanceBatch& batch, std::uint32_t instance) {
  constexpr std::size_t kLine = 64, kMostLines = 32;
  const char* const from = reinterpret_cast<const char*>(pose_of(batch, instance));
  const std::size_t bytes = std::min(batch.articulation->link_count * batch.link_stride, kMostLines * kLine);
  for (std::size_t at = 0; at < bytes; at += kLine) __builtin_prefetch(from + at);
}

std::uint32_t update_tile(const Engine& engine, const InstanceBatch& batch, const Policies& policies, float margin,
                          const TileInstances& tile, bool report, Worker& worker, BoxTile* nodes, AabbTile* aabbs) {
  const BatchInput& input = *batch.input;
  std::uint8_t flags[kLanes];
  kernel::PoseTile pose;
  pose.articulation = batch.active;
  pose.format = input.poses.format;
  pose.link_stride = batch.link_stride / sizeof(float);
  for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
    const std::uint32_t instance = tile.instance[std::min(lane, tile.count - 1)];
    pose.poses[lane] = pose_of(batch, instance);
    pose.orientations[lane] =
        input.orientations.empty() ? nullptr : input.orientations.data + 4 * std::size_t{instance};
  }
  pose.leaves = nodes;
  pose.joints = worker.joints.data;
  pose.motions = policies.refit == Refit::kAabbVertices ? worker.motions.data : nullptr;
  pose.flags = flags;
  pose.margin = kMarginShare * margin;
  pose_leaves(engine, batch, report, pose);

  if (policies.strategy != Strategy::kExactAll)
    refit(*engine.kernels, *batch.active, policies, kernel::is_rotated(pose), pose.margin, worker, nodes, aabbs);

  std::uint32_t taking_part = 0;
  for (std::uint32_t lane = 0; lane < tile.count; ++lane)
    if (flags[lane] == kInstanceOk) taking_part |= 1u << lane;
  if (!report) return taking_part;
  if (!input.flags.empty())
    for (std::uint32_t lane = 0; lane < tile.count; ++lane) input.flags[tile.instance[lane]] = flags[lane];
  worker.stats.instances_masked += tile.count - static_cast<std::uint32_t>(__builtin_popcount(taking_part));
  return taking_part;
}

}  // namespace cab
