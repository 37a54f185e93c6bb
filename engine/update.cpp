#include "engine/update.h"

#include "kernels/pose_leaves.h"

#include <algorithm>

namespace cab {

std::uint32_t update_tile(const Engine& engine, const InstanceBatch& batch, Refit refit, std::uint32_t tile,
                          bool report, Worker& worker, BoxTile* nodes, AabbTile* aabbs) {
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
  pose.flags = flags;
  engine.kernels->pose_leaves(pose);

  if (refit == Refit::kAabbHull) {
    engine.kernels->bound_boxes(nodes, batch.articulation->leaf_count, aabbs);
    engine.kernels->refit_aabb(batch.articulation->program, aabbs);
  } else {
    engine.kernels->refit_cab(batch.articulation->program, worker.joints.data, nodes);
  }

  std::uint32_t taking_part = 0;
  for (std::uint32_t lane = 0; lane < live; ++lane)
    if (flags[lane] == kInstanceOk) taking_part |= 1u << lane;
  if (!report) return taking_part;
  if (!input.flags.empty()) std::copy(flags, flags + live, input.flags.data + first);
  worker.stats.instances_masked += live - static_cast<std::uint32_t>(__builtin_popcount(taking_part));
  return taking_part;
}

}  // namespace cab
