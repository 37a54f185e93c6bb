// Boxes of a skin's leaves in their links' frames, as the poses of all links that move their vertices make them: they
// hold the skinned vertices, and no vertex is skinned (layout/skinned_leaves.h, docs/proof.md, part 19).
#pragma once

#include "kernels/box.h"
#include "kernels/rigid_lanes.h"
#include "layout/error_bounds.h"
#include "layout/skinned_leaves.h"

#include <cmath>

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

// The product of a row of three constants, and a row of three vectors.
template <class V>
CAB_INLINE V dot(const float (&v)[3], Vec3<V> w) {
  return (V(v[0]) * w.x + V(v[1]) * w.y) + V(v[2]) * w.z;
}

// What a leaf's vertices reach along an axis of its box, about its centre.
template <class V>
struct Reach {
  V middle, half;
};

// The same along axis c. seen_of(r): where the link of LeafInfluence::relative r is, seen from the leaf's, as
// relative_pose writes it.
//
// Two ranges hold the vertices, and the result is what they have in common. One takes each link's weight for a linear
// function of the place, and adds what that leaves out. The other is about the boxes of what each link moves.
template <class V, class SeenOf>
CAB_INLINE Reach<V> grown_reach(const Box& local, std::uint32_t c, Span<const LeafInfluence> influences,
                                const OwnVertices& own, SeenOf&& seen_of) {
  const V zero(0.0f);
  const float(&axis)[3] = local.axis[c];
  // The coefficients of the linear function that takes a vertex's coordinates to where it is.
  V to[3] = {zero, zero, zero};
  to[c] = V(local.half[c]);
  V middle = zero, extent = zero;
  V lo(own.center[c] - own.half[c]), hi(own.center[c] + own.half[c]);
  for (const LeafInfluence& by : influences) {
    const RigidLanes<V> seen = seen_of(by.relative);
    const Vec3<V> from = {seen.translation.x - V(local.center[0]), seen.translation.y - V(local.center[1]),
                          seen.translation.z - V(local.center[2])};
    const Vec3<V> row = {dot(axis, seen.column[0]), dot(axis, seen.column[1]), dot(axis, seen.column[2])};
    // The leaf's centre and half edges where the link takes them, and how much longer these edges are.
    const V moved = dot(axis, from) + dot(by.center, row);
    const V edge[3] = {dot(by.edge[0], row), dot(by.edge[1], row), dot(by.edge[2], row)};
    V bent[3] = {edge[0], edge[1], edge[2]};
    bent[c] = bent[c] - V(local.half[c]);
    const V size[3] = {abs(edge[0]), abs(edge[1]), abs(edge[2])};
    V size_bent[3] = {size[0], size[1], size[2]};
    size_bent[c] = abs(bent[c]);
    // Four products of each link are added in pairs (docs/proof.md, step 19.4).
    const auto add = [](V first, const float(&with)[3], const V(&b)[3]) {
      return (first + V(with[0]) * b[0]) + (V(with[1]) * b[1] + V(with[2]) * b[2]);
    };
    for (int k = 0; k < 3; ++k) to[k] = to[k] + (V(by.slope[k]) * moved + V(by.weight) * bent[k]);
    middle = middle + add(V(by.weight) * moved, by.bent_center, bent);
    extent = extent + add(V(by.slack) * abs(moved), by.bent_half, size_bent);
    const V hull_middle = add(moved, by.moved_center, edge);
    const V hull_half = dot(by.moved_half, Vec3<V>{size[0], size[1], size[2]});
    lo = min(lo, hull_middle - hull_half);
    hi = max(hi, hull_middle + hull_half);
  }
  extent = extent + ((abs(to[0]) + abs(to[1])) + abs(to[2]));
  lo = max(lo, middle - extent);
  hi = min(hi, middle + extent);
  const V half(0.5f);
  return {half * (lo + hi), max(half * (hi - lo), zero)};
}

// The box of a leaf with influences, in the frame of its link. local: the box of its vertices as they were bound, with
// the same axes.
template <class V, class SeenOf>
CAB_INLINE BoxLanes<V> grow_box(const Box& local, Span<const LeafInfluence> influences, const OwnVertices& own,
                                SeenOf&& seen_of) {
  const V base(((local.half[0] + local.half[1]) + local.half[2]) +
               ((std::fabs(local.center[0]) + std::fabs(local.center[1])) + std::fabs(local.center[2])));
  V pad(kMergePadTiny);
  for (const LeafInfluence& by : influences) {
    const RigidLanes<V> seen = seen_of(by.relative);
    pad = pad + V(by.gain) * ((seen.scale * V(by.size) + sum(abs(seen.translation))) + base);
  }
  const Reach<V> reach[3] = {grown_reach<V>(local, 0, influences, own, seen_of),
                             grown_reach<V>(local, 1, influences, own, seen_of),
                             grown_reach<V>(local, 2, influences, own, seen_of)};
  BoxLanes<V> out = spread_box<V>(local);
  out.center =
      out.center + ((reach[0].middle * out.axis[0] + reach[1].middle * out.axis[1]) + reach[2].middle * out.axis[2]);
  out.half = {reach[0].half + pad, reach[1].half + pad, reach[2].half + pad};
  return out;
}

}  // namespace cab::kernel
