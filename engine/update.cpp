#include "engine/update.h"

#include "kernels/pose_leaves.h"
#include "kernels/refit_tree.h"

#include <algorithm>

namespace cab {

namespace {

// Steps after posing: inner boxes, or bounds of every node, by the refit policy.
void refit(const kernel::KernelTable& kernels, const Articulation& articulation, const Policies& policies, bool turned,
           Worker& worker, BoxTile* nodes, AabbTile* aabbs) {
  const std::size_t extents = static_cast<std::size_t>(policies.extents);
  const bool tree = policies.strategy == Strategy::kTree;
  if (policies.refit == Refit::kAabbVertices) {
    kernels.fit_vertices({&articulation, tree ? articulation.node_count : articulation.leaf_count, worker.motions.data,
                          aabbs, turned ? kernel::kPosePadTurned : kernel::kPosePad});
  } else if (policies.refit == Refit::kAabbHull) {
    kernels.bound_boxes(nodes, articulation.leaf_count, aabbs);
    if (tree) kernels.refit_aabbs[extents](articulation.program, aabbs);
  } else if (tree) {
    kernels.refit_boxes[static_cast<std::size_t>(policies.refit)][extents](
        {&articulation.program, worker.joints.data, nodes, worker.moments.data});
  }
}

}  // namespace

std::uint32_t update_tile(const Engine& engine, const InstanceBatch& batch, const Policies& policies,
                          std::uint32_t tile, bool report, Worker& worker, BoxTile* nodes, AabbTile* aabbs) {
  const BatchInput& input = *batch.input;
  const std::uint32_t first = tile * kLanes;
  const std::uint32_t live = std::min(kLanes, batch.instance_count - first);
  std::uint8_t flags[kLanes];
  kernel::PoseTile pose;
  pose.articulation = batch.articulation;
  pose.format = input.poses.format;
  pose.poses = reinterpret_cast<const std::byte*>(input.poses.data) + first * batch.instance_stride;
  pose.link_stride = batch.link_stride;
  pose.instance_stride = batch.instance_stride;
  pose.orientations = input.orientations.empty() ? nullptr : input.orientations.data + 4 * std::size_t{first};
  pose.live = live;
  pose.leaves = nodes;
  pose.joints = worker.joints.data;
  pose.motions = policies.refit == Refit::kAabbVertices ? worker.motions.data : nullptr;
  pose.flags = flags;
  engine.kernels->pose_leaves(pose);

  if (policies.strategy != Strategy::kExactAll)
    refit(*engine.kernels, *batch.articulation, policies, pose.orientations != nullptr, worker, nodes, aabbs);

  std::uint32_t taking_part = 0;
  for (std::uint32_t lane = 0; lane < live; ++lane)
    if (flags[lane] == kInstanceOk) taking_part |= 1u << lane;
  if (!report) return taking_part;
  if (!input.flags.empty()) std::copy(flags, flags + live, input.flags.data + first);
  worker.stats.instances_masked += live - static_cast<std::uint32_t>(__builtin_popcount(taking_part));
  return taking_part;
}

}  // namespace cab
