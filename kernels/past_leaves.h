// Leaves of instances between two moments: which of them a ray comes near, and which it meets.
#pragma once

#include "kernels/pose_leaves.h"
#include "kernels/query_boxes.h"
#include "kernels/words.h"
#include "layout/center_grid.h"

#include <algorithm>

namespace cab::kernel {

// A ray near an instance, and where the centres of its leaf boxes are at two moments.
struct NearLeaves {
  BoxRay ray;                   // begins at 0
  const CenterGrid &from, &to;  // relative to its origin
  const std::uint32_t* from_cells;
  const std::uint32_t* to_cells;  // by leaf; up to a multiple of kLanes can be read
  const float* radius;            // by leaf, and kLanes more can be read: of a ball about the centre that holds the box
  std::uint32_t leaves;
  float part;   // of the way to the later moment, 0 to 1
  float scale;  // of the instance
  float bulge;  // how far a centre may leave the straight line between both moments; 0 at a moment
};

// Writes the leaves whose balls the ray comes to (docs/proof.md, step 13.6), in their order. Returns how many.
template <class V>
std::uint32_t near_leaves(const NearLeaves& args, std::uint16_t* out) {
  const BoxRay& ray = args.ray;
  const CenterGrid &from = args.from, &to = args.to;
  const Vec3<V> at = {V(ray.at[0]), V(ray.at[1]), V(ray.at[2])};
  const Vec3<V> direction = {V(ray.direction[0]), V(ray.direction[1]), V(ray.direction[2])};
  const float in_cell = CenterGrid::kError * std::max(from.cell, to.cell);
  const V scale(args.scale), more((ray.radius + ray.rounding) + in_cell + args.bulge);
  std::uint32_t count = 0;
  for (std::uint32_t first = 0; first < args.leaves; first += kWidth<V>) {
    const auto cells_from = Words<V>::load(args.from_cells + first), cells_to = Words<V>::load(args.to_cells + first);
    const auto center = [&](std::uint32_t c) {
      const std::uint32_t shift = CenterGrid::kBits * c, mask = CenterGrid::kMostCell << shift;
      const float unit = 1 / static_cast<float>(1u << shift);
      return V(from.low[c] + args.part * (to.low[c] - from.low[c])) +
             (V(unit * (1 - args.part) * from.cell) * Words<V>::number(cells_from, mask) +
              V(unit * args.part * to.cell) * Words<V>::number(cells_to, mask));
    };
    const Vec3<V> middle = {center(0), center(1), center(2)}, away = middle - at;
    const V nearest = min(max(dot(away, direction), V(0.0f)), V(ray.end));
    const Vec3<V> apart = away - nearest * direction;
    const V reach = (scale * Lanes<V>::load_unaligned(args.radius + first) + more) +
                    V(static_cast<float>(kHistoryPad)) * sum(abs(middle));
    std::uint32_t near = ~bits(dot(apart, apart) > reach * reach) & ((1u << kWidth<V>)-1);
    if (args.leaves - first < kWidth<V>) near &= (1u << (args.leaves - first)) - 1;
    for (; near; near &= near - 1) out[count++] = static_cast<std::uint16_t>(first + lowest_bit(near));
  }
  return count;
}

// Sixteen leaves, each of an instance of its own, and a ray near each instance: the rays begin at 0. Pointers of unused
// lanes repeat those of a used one.
struct PastLeaves {
  PoseCoding coding;                  // quaternions
  bool is_between;                    // whether one of the lanes is between two moments
  const float* poses[kLanes];         // of the link
  const float* boxes[kLanes];         // the leaf's box in the frame of its link, a Box
  const float* orientations[kLanes];  // as in PoseTile
  alignas(64) float scales[kLanes];
  LaterPoses later;
  float pads;  // as in PoseTile
  alignas(64) float at[3][kLanes], direction[3][kLanes];
  alignas(64) float radius[kLanes], rounding[kLanes];  // rounding: without what follows from the box
  alignas(64) float end[kLanes], end_below[kLanes];    // rounded upwards and downwards

  // Receive the posed boxes, those of pose_leaves bit for bit; the lanes whose poses are valid, and of these the ones
  // whose boxes the ray may meet; at which t it enters them, or less; and at which t its centre has surely entered
  // them, or more, or infinity.
  BoxTile posed;
  std::uint32_t live, met;
  alignas(64) float entry[kLanes], surely[kLanes];
};

template <class V>
void meet_past_leaves(PastLeaves& tile) {
  const auto load3 = [](const float(&from)[3][kLanes], std::uint32_t lane) {
    return Vec3<V>{Lanes<V>::load(from[0] + lane), Lanes<V>::load(from[1] + lane), Lanes<V>::load(from[2] + lane)};
  };
  constexpr std::uint32_t kFloats = pose_floats(PoseFormat::kQuaternionTranslation);
  const bool is_rotated = tile.orientations[0] != nullptr;
  RawPoses raw, rotations, later, local;
  read_raw<V>(tile.poses, 0, kFloats, raw);
  read_raw<V>(tile.boxes, 0, kBoxFloats, local);
  if (is_rotated) read_raw<V>(tile.orientations, 0, 4, rotations);
  if (tile.is_between) {
    read_raw<V>(tile.later.poses, 0, kFloats, later);
    blend_poses<V>(later, tile.later.part, kFloats, raw);
    if (is_rotated) {
      read_raw<V>(tile.later.orientations, 0, 4, later);
      blend_poses<V>(later, tile.later.part, 4, rotations);
    }
  }
  tile.live = tile.met = 0;
  for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>) {
    const Mask<V> yes = V(0.0f) <= V(0.0f);
    LaneChecks<V> checks = {yes, yes, yes};
    const RigidLanes<V> pose =
        placed_pose(raw, {tile.coding, is_rotated ? &rotations : nullptr, tile.scales}, lane, checks);
    const auto row = [&](std::uint32_t f) {
      return Vec3<V>{Lanes<V>::load(local.raw[f] + lane), Lanes<V>::load(local.raw[f + 1] + lane),
                     Lanes<V>::load(local.raw[f + 2] + lane)};
    };
    const BoxLanes<V> box = pose_scaled_boxes(pose, BoxLanes<V>{row(0), {row(3), row(6), row(9)}, row(12)},
                                              pad_of(is_rotated, tile.pads), V(0.0f));
    store_box(tile.posed, lane, box);
    checks.in_range = both(checks.in_range, both(in_range(box.center), in_range(box.half)));
    const V reach = max_component(abs(box.center)) + (box.half.x + box.half.y + box.half.z);
    const RaysNear<V> ray = {load3(tile.at, lane), load3(tile.direction, lane), Lanes<V>::load(tile.radius + lane),
                             Lanes<V>::load(tile.rounding + lane) + V(static_cast<float>(kQueryBoxPad)) * reach};
    V near(0.0f), far = Lanes<V>::load(tile.end + lane);
    cut_to_box<BoxSize::kLarger>(box, ray, near, far);
    Lanes<V>::store(tile.entry + lane, near);
    V near_surely(0.0f), far_surely = Lanes<V>::load(tile.end_below + lane);
    cut_to_box<BoxSize::kSmaller>(box, ray, near_surely, far_surely);
    const V never(std::numeric_limits<float>::infinity());
    Lanes<V>::store(tile.surely + lane, select(far_surely >= near_surely, near_surely, never));
    const std::uint32_t live = bits(both(checks.finite, both(checks.rigid, checks.in_range)));
    tile.live |= (live & ((1u << kWidth<V>)-1)) << lane;
    tile.met |= (live & ~bits(near > far) & ((1u << kWidth<V>)-1)) << lane;
  }
}

}  // namespace cab::kernel
