// Boxes of a skin's leaves in their links' frames, as the poses of all links that move their vertices make them: they
// hold the skinned vertices, and no vertex is skinned (layout/skinned_leaves.h, docs/proof.md, part 19).
#pragma once

#include "kernels/box.h"
#include "kernels/rigid_lanes.h"
#include "kernels/transpose.h"
#include "layout/error_bounds.h"
#include "layout/skinned_leaves.h"

#include <cstddef>

namespace cab::kernel {

// Where a link is, seen from `base`: its origin; its axes times how much longer its lengths are; and that factor.
template <class V>
CAB_INLINE RigidLanes<V> relative_pose(const RigidLanes<V>& base, const RigidLanes<V>& link) {
  const auto turn_back = [&](Vec3<V> v) {
    return Vec3<V>{dot(base.column[0], v), dot(base.column[1], v), dot(base.column[2], v)};
  };
  const V by = divide(V(1.0f), base.scale);
  RigidLanes<V> out;
  out.scale = link.scale * by;
  out.translation = by * turn_back(link.translation - base.translation);
  for (int k = 0; k < 3; ++k) out.column[k] = out.scale * turn_back(link.column[k]);
  return out;
}

// The places of LeafInfluence's numbers.
template <std::size_t kOffset>
inline constexpr std::uint32_t kPlace = kOffset / sizeof(float);
inline constexpr std::uint32_t kInfluenceCenter = kPlace<offsetof(LeafInfluence, center)>,
                               kInfluenceEdge = kPlace<offsetof(LeafInfluence, edge)>,
                               kInfluenceSize = kPlace<offsetof(LeafInfluence, size)>,
                               kInfluenceWeight = kPlace<offsetof(LeafInfluence, weight)>,
                               kInfluenceSlope = kPlace<offsetof(LeafInfluence, slope)>,
                               kInfluenceSlack = kPlace<offsetof(LeafInfluence, slack)>,
                               kInfluenceBentCenter = kPlace<offsetof(LeafInfluence, bent_center)>,
                               kInfluenceBentHalf = kPlace<offsetof(LeafInfluence, bent_half)>,
                               kInfluenceMovedCenter = kPlace<offsetof(LeafInfluence, moved_center)>,
                               kInfluenceMovedHalf = kPlace<offsetof(LeafInfluence, moved_half)>,
                               kInfluenceGain = kPlace<offsetof(LeafInfluence, gain)>;

// The numbers of one leaf, or of one influence, the same in every lane.
template <class V>
struct SpreadLeaf {
  const Box& box;
  const OwnVertices& own;
  CAB_INLINE V axis(int k, int c) const { return V(box.axis[k][c]); }
  CAB_INLINE V center(int c) const { return V(box.center[c]); }
  CAB_INLINE V half(int c) const { return V(box.half[c]); }
  CAB_INLINE V own_center(int c) const { return V(own.center[c]); }
  CAB_INLINE V own_half(int c) const { return V(own.half[c]); }
};
template <class V>
struct SpreadInfluence {
  const float* value;
  CAB_INLINE V at(std::uint32_t place) const { return V(value[place]); }
};

template <class V>
CAB_INLINE SpreadInfluence<V> spread(const LeafInfluence& by) {
  return {reinterpret_cast<const float*>(&by)};
}

// Those of as many leaves as V has lanes, from `lane` on.
template <class V>
struct LeavesFrom {
  const LeafLanes& block;
  std::uint32_t lane;
  CAB_INLINE V axis(int k, int c) const { return Lanes<V>::load(block.axis[k][c] + lane); }
  CAB_INLINE V center(int c) const { return Lanes<V>::load(block.center[c] + lane); }
  CAB_INLINE V half(int c) const { return Lanes<V>::load(block.half[c] + lane); }
  CAB_INLINE V own_center(int c) const { return Lanes<V>::load(block.own_center[c] + lane); }
  CAB_INLINE V own_half(int c) const { return Lanes<V>::load(block.own_half[c] + lane); }
};
template <class V>
struct InfluencesFrom {
  const InfluenceLanes& round;
  std::uint32_t lane;
  CAB_INLINE V at(std::uint32_t place) const { return Lanes<V>::load(round.value[place] + lane); }
};

// What is known so far of where a leaf's vertices are along an axis of its box, about its centre.
//
// Two ranges hold the vertices, and the result is what they have in common. One takes each link's weight for a linear
// function of the place, and adds what that leaves out. The other, lo to hi, is about the boxes of what each link
// moves.
template <class V>
struct Growth {
  V to[3];  // the coefficients of the linear function that takes a vertex's coordinates to where it is
  V middle, extent;
  V lo, hi;
};

template <int c, class V, class Leaf>
CAB_INLINE Growth<V> begin_growth(const Leaf& leaf) {
  const V zero(0.0f);
  Growth<V> out = {
      {zero, zero, zero}, zero, zero, leaf.own_center(c) - leaf.own_half(c), leaf.own_center(c) + leaf.own_half(c)};
  out.to[c] = leaf.half(c);
  return out;
}

// Adds what one link does to the vertices, along axis c. seen: where it is, seen from the leaf's link, as relative_pose
// writes it.
template <int c, class V, class Leaf, class Influence>
CAB_INLINE void add_influence(const Leaf& leaf, const Influence& by, const RigidLanes<V>& seen, Growth<V>& out) {
  const Vec3<V> axis = {leaf.axis(c, 0), leaf.axis(c, 1), leaf.axis(c, 2)};
  const auto three = [&by](std::uint32_t place) { return Vec3<V>{by.at(place), by.at(place + 1), by.at(place + 2)}; };
  const Vec3<V> from = {seen.translation.x - leaf.center(0), seen.translation.y - leaf.center(1),
                        seen.translation.z - leaf.center(2)};
  const Vec3<V> row = {dot(axis, seen.column[0]), dot(axis, seen.column[1]), dot(axis, seen.column[2])};
  // The leaf's centre and half edges where the link takes them, and how much longer these edges are.
  const V moved = dot(axis, from) + dot(three(kInfluenceCenter), row);
  const V edge[3] = {dot(three(kInfluenceEdge), row), dot(three(kInfluenceEdge + 3), row),
                     dot(three(kInfluenceEdge + 6), row)};
  V bent[3] = {edge[0], edge[1], edge[2]};
  bent[c] = bent[c] - leaf.half(c);
  const V size[3] = {abs(edge[0]), abs(edge[1]), abs(edge[2])};
  V size_bent[3] = {size[0], size[1], size[2]};
  size_bent[c] = abs(bent[c]);
  // Four products of each link are added in pairs (docs/proof.md, step 19.4).
  const auto add = [&by](V first, std::uint32_t with, const V(&b)[3]) {
    return (first + by.at(with) * b[0]) + (by.at(with + 1) * b[1] + by.at(with + 2) * b[2]);
  };
  const V weight = by.at(kInfluenceWeight);
  for (std::uint32_t k = 0; k < 3; ++k) out.to[k] = out.to[k] + (by.at(kInfluenceSlope + k) * moved + weight * bent[k]);
  out.middle = out.middle + add(weight * moved, kInfluenceBentCenter, bent);
  out.extent = out.extent + add(by.at(kInfluenceSlack) * abs(moved), kInfluenceBentHalf, size_bent);
  const V hull_middle = add(moved, kInfluenceMovedCenter, edge);
  const V hull_half = dot(three(kInfluenceMovedHalf), Vec3<V>{size[0], size[1], size[2]});
  out.lo = min(out.lo, hull_middle - hull_half);
  out.hi = max(out.hi, hull_middle + hull_half);
}

// The padding for the rounding of one influence. base: that of the leaf.
template <class V, class Influence>
CAB_INLINE V growth_pad(const Influence& by, const RigidLanes<V>& seen, V base) {
  return by.at(kInfluenceGain) * ((seen.scale * by.at(kInfluenceSize) + sum(abs(seen.translation))) + base);
}

// The size of a leaf and how far it is from its link, for growth_pad.
template <class V, class Leaf>
CAB_INLINE V size_of_leaf(const Leaf& leaf) {
  return sum(Vec3<V>{leaf.half(0), leaf.half(1), leaf.half(2)}) +
         sum(abs(Vec3<V>{leaf.center(0), leaf.center(1), leaf.center(2)}));
}

// The centre and the half extents of a grown box in the frame of its link; it has the axes of the leaf's box.
template <class V>
struct GrownLanes {
  Vec3<V> center, half;
};

template <class V, class Leaf>
CAB_INLINE GrownLanes<V> finish_growth(const Leaf& leaf, const Growth<V> (&along)[3], V pad) {
  const V half(0.5f), zero(0.0f);
  V at[3], size[3];
  for (int c = 0; c < 3; ++c) {
    const Growth<V>& sums = along[c];
    const V extent = sums.extent + ((abs(sums.to[0]) + abs(sums.to[1])) + abs(sums.to[2]));
    const V lo = max(sums.lo, sums.middle - extent), hi = min(sums.hi, sums.middle + extent);
    at[c] = half * (lo + hi);
    size[c] = max(half * (hi - lo), zero) + pad;
  }
  const auto axis = [&leaf](int k) { return Vec3<V>{leaf.axis(k, 0), leaf.axis(k, 1), leaf.axis(k, 2)}; };
  return {
      Vec3<V>{leaf.center(0), leaf.center(1), leaf.center(2)} + ((at[0] * axis(0) + at[1] * axis(1)) + at[2] * axis(2)),
      {size[0], size[1], size[2]}};
}

// All influences of a leaf along axis c, instances as lanes.
template <int c, class V, class SeenOf>
CAB_INLINE Growth<V> growth_along(const SpreadLeaf<V>& leaf, Span<const LeafInfluence> influences, SeenOf&& seen_of) {
  Growth<V> out = begin_growth<c, V>(leaf);
  for (const LeafInfluence& by : influences) {
    const RigidLanes<V> seen = seen_of(by.relative);
    add_influence<c>(leaf, spread<V>(by), seen, out);
  }
  return out;
}

// The grown box of a leaf with influences, instances as lanes. local: the box of its vertices as they were bound.
// seen_of(r): where the link of LeafInfluence::relative r is, seen from the leaf's. Each axis has a pass of its own:
// the sums of three would not fit the registers.
template <class V, class SeenOf>
CAB_INLINE GrownLanes<V> grow_box(const Box& local, Span<const LeafInfluence> influences, const OwnVertices& own,
                                  SeenOf&& seen_of) {
  const SpreadLeaf<V> leaf = {local, own};
  const V base = size_of_leaf<V>(leaf);
  V pad(kMergePadTiny);
  for (const LeafInfluence& by : influences) pad = pad + growth_pad<V>(spread<V>(by), seen_of(by.relative), base);
  const Growth<V> along[3] = {growth_along<0, V>(leaf, influences, seen_of),
                              growth_along<1, V>(leaf, influences, seen_of),
                              growth_along<2, V>(leaf, influences, seen_of)};
  return finish_growth(leaf, along, pad);
}

// ------------------------------------------------------------------------------------------- leaves as lanes

// Where a link is, or is seen from another, as a row of floats.
inline constexpr std::uint32_t kRowFloats = 16;

template <class V>
CAB_INLINE RigidLanes<V> load_rows(const float* const* rows) {
  V f[kRowFloats];
  Transpose<V>::load(rows, f);
  return {{{f[0], f[1], f[2]}, {f[3], f[4], f[5]}, {f[6], f[7], f[8]}}, {f[9], f[10], f[11]}, f[12]};
}

template <class V>
CAB_INLINE void store_rows(const RigidLanes<V>& from, float* const* rows) {
  const V zero(0.0f);
  const V f[kRowFloats] = {from.column[0].x,
                           from.column[0].y,
                           from.column[0].z,
                           from.column[1].x,
                           from.column[1].y,
                           from.column[1].z,
                           from.column[2].x,
                           from.column[2].y,
                           from.column[2].z,
                           from.translation.x,
                           from.translation.y,
                           from.translation.z,
                           from.scale,
                           zero,
                           zero,
                           zero};
  Transpose<V>::store(f, rows);
}

// Writes where a link is in one lane of a tile as a row.
CAB_INLINE void write_row(const MotionTile& tile, std::uint32_t lane, float* row) {
  for (int k = 0; k < 3; ++k)
    for (int c = 0; c < 3; ++c) row[3 * k + c] = tile.column[k][c][lane];
  for (int c = 0; c < 3; ++c) row[9 + c] = tile.translation[c][lane];
  row[12] = tile.scale[lane];
}

// The centre and the half extents of a leaf's grown box, one instance per lane.
struct alignas(64) GrownTile {
  float center[3][kLanes], half[3][kLanes];
};

// add_influence, in the lanes of leaves that have it.
template <int c, class V>
CAB_INLINE void keep_influence(const LeavesFrom<V>& leaf, const InfluencesFrom<V>& by, const RigidLanes<V>& seen,
                               const Mask<V>& is_there, Growth<V>& sums) {
  Growth<V> more = sums;
  add_influence<c>(leaf, by, seen, more);
  for (int k = 0; k < 3; ++k) sums.to[k] = select(is_there, more.to[k], sums.to[k]);
  sums.middle = select(is_there, more.middle, sums.middle);
  sums.extent = select(is_there, more.extent, sums.extent);
  sums.lo = select(is_there, more.lo, sums.lo);
  sums.hi = select(is_there, more.hi, sums.hi);
}

// Writes a number to one lane, or to all.
template <class V>
CAB_INLINE void write_lane(float number, std::uint32_t lane, bool to_all, float (&row)[kLanes]) {
  if (!to_all) row[lane] = number;
  for (std::uint32_t from = 0; to_all && from < kLanes; from += kWidth<V>) Lanes<V>::store(row + from, V(number));
}

// Writes where one instance's links are, seen from others. links: by link, where it is, as rows. relatives: receives
// the rows of SkinnedLeaves::relatives, a multiple of sixteen.
template <class V>
CAB_INLINE void write_relatives(const SkinnedLeaves& skin, const float* links, float* relatives) {
  const auto count = static_cast<std::uint32_t>(skin.relatives.size);
  for (std::uint32_t first = 0; first < count; first += kWidth<V>) {
    const float *base[kWidth<V>], *link[kWidth<V>];
    float* to[kWidth<V>];
    for (std::uint32_t i = 0; i < kWidth<V>; ++i) {
      const std::uint32_t r = first + i < count ? first + i : count - 1;
      base[i] = links + std::size_t{kRowFloats} * skin.relative_from[r];
      link[i] = links + std::size_t{kRowFloats} * skin.relatives[r];
      to[i] = relatives + std::size_t{kRowFloats} * (first + i);
    }
    store_rows(relative_pose(load_rows<V>(base), load_rows<V>(link)), to);
  }
}

// Grows the boxes of one instance, leaves as lanes, to the same bits. relatives: what write_relatives writes.
// take(leaves, grown) is called once for each kWidth<V> lanes of a block. Leaves without influences keep their boxes.
template <class V, class Take>
CAB_INLINE void grow_alone(const SkinnedLeaves& skin, const float* relatives, Take&& take) {
  for (const LeafLanes& block : skin.lanes)
    for (std::uint32_t from = 0; from < kLanes; from += kWidth<V>) {
      const LeavesFrom<V> leaf = {block, from};
      Growth<V> along[3] = {begin_growth<0, V>(leaf), begin_growth<1, V>(leaf), begin_growth<2, V>(leaf)};
      const V base = size_of_leaf<V>(leaf);
      V pad(kMergePadTiny);
      Mask<V> grows = V(0.0f) > V(0.0f);
      for (std::uint32_t r = block.first_round; r < block.first_round + block.rounds; ++r) {
        const InfluenceLanes& round = skin.rounds[r];
        const float* rows[kWidth<V>];
        for (std::uint32_t i = 0; i < kWidth<V>; ++i)
          rows[i] = relatives + std::size_t{kRowFloats} * round.relative[from + i];
        const RigidLanes<V> seen = load_rows<V>(rows);
        const InfluencesFrom<V> by = {round, from};
        const Mask<V> is_there = Lanes<V>::load(round.is_there + from) > V(0.0f);
        pad = select(is_there, pad + growth_pad<V>(by, seen, base), pad);
        keep_influence<0>(leaf, by, seen, is_there, along[0]);
        keep_influence<1>(leaf, by, seen, is_there, along[1]);
        keep_influence<2>(leaf, by, seen, is_there, along[2]);
        grows = either(grows, is_there);
      }
      GrownLanes<V> grown = finish_growth(leaf, along, pad);
      grown.center = choose<V>(grows, grown.center, {leaf.center(0), leaf.center(1), leaf.center(2)});
      grown.half = choose<V>(grows, grown.half, {leaf.half(0), leaf.half(1), leaf.half(2)});
      take(leaf, grown);
    }
}

// Writes the grown boxes of one instance by leaf: to its lane, and to all lanes if it is the last one.
template <class V>
CAB_INLINE void grow_lane(const SkinnedLeaves& skin, const float* relatives, std::uint32_t lane, bool is_last,
                          GrownTile* out) {
  grow_alone<V>(skin, relatives, [&](const LeavesFrom<V>& leaves, const GrownLanes<V>& grown) {
    alignas(64) float numbers[6][kWidth<V>];
    const V each[6] = {grown.center.x, grown.center.y, grown.center.z, grown.half.x, grown.half.y, grown.half.z};
    for (int f = 0; f < 6; ++f) Lanes<V>::store(numbers[f], each[f]);
    for (std::uint32_t i = 0; i < kWidth<V>; ++i) {
      GrownTile& to = out[leaves.block.leaf[leaves.lane + i]];
      for (int c = 0; c < 3; ++c) {
        write_lane<V>(numbers[c][i], lane, is_last, to.center[c]);
        write_lane<V>(numbers[3 + c][i], lane, is_last, to.half[c]);
      }
    }
  });
}

}  // namespace cab::kernel
