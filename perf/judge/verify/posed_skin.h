// The leaves of sixteen instances of a skin, posed by the kernels themselves.
#pragma once

#include "kernels/kernel_table.h"
#include "kernels/pose_leaves.h"
#include "layout/articulation.h"
#include "perf/judge/oracle/random_skins.h"

#include <algorithm>
#include <vector>

namespace cab::perf {

struct PosedSkin {
  std::vector<BoxTile> leaves;
  std::uint8_t flags[kLanes];
};

// margins: by how much boxes grow besides, by instance. count: how many instances are posed; the last one is repeated.
// leaves_are_lanes, range: as in PoseTile.
inline PosedSkin pose_skin(const kernel::KernelTable& kernels, const Articulation& articulation,
                           const oracle::Poses& poses, const float (&margins)[kLanes] = {},
                           std::uint32_t count = kLanes, bool leaves_are_lanes = false, float range = kMaxCoordinate) {
  PosedSkin out;
  out.leaves.resize(leaves_are_lanes ? count * tile_count(articulation.leaf_count) : articulation.leaf_count);
  std::vector<PointTile> joints(articulation.link_count);
  std::vector<MotionTile> skin(skin_tiles(articulation));
  std::vector<kernel::GrownTile> grown(articulation.leaf_count);
  std::vector<MotionTile> rows(skin_rows(articulation) * kernel::kRowFloats * sizeof(float) / sizeof(MotionTile) + 1);
  kernel::PoseTile job = {};
  job.articulation = &articulation;
  job.coding.format = poses.format;
  job.coding.scaling = poses.has_scale         ? Scaling::kInMatrices
                       : !poses.scales.empty() ? Scaling::kPerInstance
                                               : Scaling::kNone;
  job.link_stride = poses.floats_per_pose();
  kernel::point_lanes(poses.data.data(), articulation.link_count * job.link_stride, count, job.poses);
  if (!poses.orientations.empty()) kernel::point_lanes(poses.orientations.data(), 4, count, job.orientations);
  for (std::uint32_t lane = 0; lane < kLanes && !poses.scales.empty(); ++lane)
    job.scales[lane] = poses.scales[std::min(lane, count - 1)];
  for (std::uint32_t lane = 0; lane < kLanes; ++lane) job.margins[lane] = margins[std::min(lane, count - 1)];
  job.leaves = out.leaves.data();
  job.joints = joints.data();
  job.skin = skin.data();
  job.skin_rows = reinterpret_cast<float*>(rows.data());  // aligned like these
  job.grown = grown.data();
  job.count = count;
  job.leaves_are_lanes = leaves_are_lanes;
  job.range = range;
  job.flags = out.flags;
  kernels.pose_leaves(job);
  return out;
}

}  // namespace cab::perf
