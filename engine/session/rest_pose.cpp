// Finds the links that touch in a rest pose: poses one instance and tests all pairs of its leaves.
#include "engine/session/rest_pose.h"

#include "engine/session/validate.h"
#include "kernels/descend_tiles.h"
#include "kernels/pose_leaves.h"
#include "layout/valid_poses.h"

#include <algorithm>

namespace cab {

Status links_that_touch(const kernel::KernelTable& kernels, const Articulation& articulation, const PoseView& pose,
                        Arena& scratch, Span<const LinkPair>* out) {
  if (!valid_poses(pose, articulation.link_count)) return Status::kBadRestPose;
  const Span<BoxTile> leaves = scratch.allocate<BoxTile>(articulation.leaf_count);
  std::uint8_t flags[kLanes];
  kernel::PoseTile tile = {};
  tile.articulation = &articulation;
  tile.coding = coding_of(pose);
  kernel::point_lanes(pose.data, 0, 1, tile.poses);
  tile.link_stride = link_bytes(pose) / sizeof(float);
  tile.leaves = leaves.data;
  tile.joints = scratch.allocate<PointTile>(articulation.link_count).data;
  tile.flags = flags;
  tile.skin = scratch.allocate<MotionTile>(skin_tiles(articulation)).data;
  kernels.pose_leaves(tile);
  if (flags[0] != kInstanceOk) return Status::kBadRestPose;

  // Pairs that the articulation ignores for other reasons are tested too. Only pairs of leaves of one link are left
  // out.
  Articulation all_pairs = articulation;
  const std::size_t links = articulation.link_count;
  const Span<std::uint64_t> diagonal = scratch.allocate<std::uint64_t>((links * links + 63) / 64);
  for (std::size_t bit = 0; bit < links * links; bit += links + 1) diagonal[bit >> 6] |= std::uint64_t{1} << (bit & 63);
  all_pairs.ignored_bits = {diagonal.data, diagonal.size};

  const std::uint32_t most = articulation.leaf_count * (articulation.leaf_count - 1) / 2;
  kernel::TileDescent<BoxTile> descent = {};
  descent.articulation_a = descent.articulation_b = &all_pairs;
  descent.nodes_a = descent.nodes_b = leaves.data;
  descent.lanes = 1;
  descent.self = true;
  descent.found = {scratch.allocate<TilePair>(most).data, most, 0};
  kernels.brute_boxes[static_cast<std::size_t>(Sat::kAll15)](descent);

  const Span<LinkPair> touching = scratch.allocate<LinkPair>(descent.found.size);
  std::transform(descent.found.begin(), descent.found.end(), touching.begin(), [&](const TilePair& pair) {
    return LinkPair{articulation.leaf_link[pair.a], articulation.leaf_link[pair.b]};
  });
  *out = {touching.data, touching.size};
  return Status::kOk;
}

}  // namespace cab
