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

// margins: by how much boxes grow besides, by instance.
inline PosedSkin pose_skin(const kernel::KernelTable& kernels, const Articulation& articulation,
                           const oracle::Poses& poses, const float (&margins)[kLanes] = {}) {
  PosedSkin out;
  out.leaves.resize(articulation.leaf_count);
  std::vector<PointTile> joints(articulation.link_count);
  std::vector<MotionTile> skin(skin_tiles(articulation));
  kernel::PoseTile job = {};
  job.articulation = &articulation;
  job.coding.format = poses.format;
  job.coding.scaling = poses.has_scale         ? Scaling::kInMatrices
                       : !poses.scales.empty() ? Scaling::kPerInstance
                                               : Scaling::kNone;
  job.link_stride = poses.floats_per_pose();
  kernel::point_lanes(poses.data.data(), articulation.link_count * job.link_stride, kLanes, job.poses);
  if (!poses.orientations.empty()) kernel::point_lanes(poses.orientations.data(), 4, kLanes, job.orientations);
  if (!poses.scales.empty()) std::copy_n(poses.scales.data(), kLanes, job.scales);
  std::copy_n(margins, kLanes, job.margins);
  job.leaves = out.leaves.data();
  job.joints = joints.data();
  job.skin = skin.data();
  job.flags = out.flags;
  kernels.pose_leaves(job);
  return out;
}

}  // namespace cab::perf
