// Posing on demand: one link of one instance, its leaves as lanes.
#pragma once

#include "kernels/gather_pairs.h"
#include "kernels/pose_leaves.h"
#include "layout/leaf_bounds_soa.h"

#include <algorithm>

namespace cab::kernel {

// One link to pose. local: the leaf boxes in the link's frame, leaves as lanes. The kernel makes the same boxes as
// pose_leaves, bit for bit. It writes them to `boxes` as records, and their bounds to leaf_bounds as arrays.
struct PoseLink {
  StoredPose at;
  const BoxTile* local;
  std::uint32_t leaf_count;
  float margin;
  BoxAos* boxes;
  float* leaf_bounds;
};

// Copies one pose into every lane.
template <class V>
CAB_INLINE void spread_raw(const float* from, std::uint32_t floats, RawPoses& out) {
  for (std::uint32_t f = 0; f < floats; ++f) Lanes<V>::store(out.raw[f], V(from[f]));
}

template <class V>
void pose_link_leaves(const PoseLink& args) {
  const Mask<V> yes = V(0.0f) <= V(0.0f);
  LaneChecks<V> checks = {yes, yes, yes};  // not read: pose_leaves checked the pose when the instance was bounded
  RawPoses raw, rotations;
  spread_raw<V>(args.at.pose, pose_floats(args.at.coding.format), raw);
  if (args.at.orientation) spread_raw<V>(args.at.orientation, 4, rotations);
  alignas(64) float scales[kWidth<V>];
  Lanes<V>::store(scales, V(args.at.scale));
  const RigidLanes<V> pose =
      placed_pose<V>(raw, {args.at.coding, args.at.orientation ? &rotations : nullptr, scales}, 0, checks);
  const PosePad pad = pad_of(args.at.orientation != nullptr, 1);
  const std::uint32_t width = leaf_bounds_width(args.leaf_count);
  for (std::uint32_t first = 0; first < args.leaf_count; first += kLanes) {
    BoxTile tile;
    for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>) {
      const BoxLanes<V> box =
          pose_scaled_boxes(pose, load_box<V>(args.local[first / kLanes], lane), pad, V(args.margin));
      store_box(tile, lane, box);
      const AabbLanes<V> bounds = bounds_of(box);
      const V sides[6] = {bounds.lo.x, bounds.lo.y, bounds.lo.z, bounds.hi.x, bounds.hi.y, bounds.hi.z};
      for (std::uint32_t r = 0; r < 6; ++r)
        Lanes<V>::store(args.leaf_bounds + std::size_t{r} * width + first + lane, sides[r]);
    }
    boxes_to_aos<V>(&tile, 1, std::min(kLanes, args.leaf_count - first), args.boxes + first, 1);
  }
  for (std::uint32_t i = args.leaf_count; i < width; ++i)
    for (std::uint32_t r = 0; r < 6; ++r) args.leaf_bounds[std::size_t{r} * width + i] = r < 3 ? kNoLeafLo : -kNoLeafLo;
}

}  // namespace cab::kernel
