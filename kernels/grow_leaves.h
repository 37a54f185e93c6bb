// Boxes of a skin's leaves in their links' frames, as the poses of all links that move their vertices make them: they
// hold the skinned vertices, and no vertex is skinned (layout/skinned_leaves.h, docs/proof.md, part 19).
#pragma once

#include "kernels/box.h"
#include "kernels/rigid_lanes.h"
#include "layout/error_bounds.h"
#include "layout/skinned_leaves.h"

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

template <class V>
CAB_INLINE Vec3<V> spread(const float (&v)[3]) {
  return {V(v[0]), V(v[1]), V(v[2])};
}

// The box of a leaf with influences, in the frame of its link. local: the box of its vertices as they were bound, with
// the same axes. seen_of(r): where the link of LeafInfluence::relative r is, seen from the leaf's, as relative_pose
// writes it.
//
// Two boxes hold the vertices, and the result is what they have in common. One takes each link's weight for a linear
// function of the place, and adds what that leaves out. The other is about the boxes of what each link moves.
template <class V, class SeenOf>
CAB_INLINE BoxLanes<V> grow_box(const BoxLanes<V>& local, Span<const LeafInfluence> influences, const OwnVertices& own,
                                SeenOf&& seen_of) {
  const auto along = [&](Vec3<V> p) {
    return Vec3<V>{dot(local.axis[0], p), dot(local.axis[1], p), dot(local.axis[2], p)};
  };
  const V zero(0.0f);
  const Vec3<V> none = {zero, zero, zero};
  // Columns of the linear function that takes a vertex's coordinates to where it is.
  Vec3<V> to[3] = {{local.half.x, zero, zero}, {zero, local.half.y, zero}, {zero, zero, local.half.z}};
  Vec3<V> middle = none, extent = none;
  Vec3<V> lo = spread<V>(own.center) - spread<V>(own.half), hi = spread<V>(own.center) + spread<V>(own.half);
  const V base = sum(local.half) + sum(abs(local.center));
  V pad(kMergePadTiny);
  for (const LeafInfluence& by : influences) {
    const RigidLanes<V> seen = seen_of(by.relative);
    const auto turn = [&](const float(&v)[3]) {
      return V(v[0]) * seen.column[0] + V(v[1]) * seen.column[1] + V(v[2]) * seen.column[2];
    };
    // The leaf's centre and half edges where the link takes them, and how much longer these edges are.
    const Vec3<V> moved = along((seen.translation + turn(by.center)) - local.center);
    const Vec3<V> edge[3] = {along(turn(by.edge[0])), along(turn(by.edge[1])), along(turn(by.edge[2]))};
    Vec3<V> bent[3] = {edge[0], edge[1], edge[2]};
    bent[0].x = bent[0].x - local.half.x;
    bent[1].y = bent[1].y - local.half.y;
    bent[2].z = bent[2].z - local.half.z;
    // Four products of each link are added in pairs (docs/proof.md, step 19.4).
    const auto add = [&](V first, Vec3<V> a, const float(&with)[3], const Vec3<V>(&b)[3]) {
      return (first * a + V(with[0]) * b[0]) + (V(with[1]) * b[1] + V(with[2]) * b[2]);
    };
    const Vec3<V> sizes_bent[3] = {abs(bent[0]), abs(bent[1]), abs(bent[2])};
    const Vec3<V> sizes[3] = {abs(edge[0]), abs(edge[1]), abs(edge[2])};
    for (int k = 0; k < 3; ++k) to[k] = to[k] + (V(by.slope[k]) * moved + V(by.weight) * bent[k]);
    middle = middle + add(V(by.weight), moved, by.bent_center, bent);
    extent = extent + add(V(by.slack), abs(moved), by.bent_half, sizes_bent);
    const Vec3<V> hull_center = add(V(1.0f), moved, by.moved_center, edge);
    const Vec3<V> hull_half = add(zero, none, by.moved_half, sizes);
    lo = min(lo, hull_center - hull_half);
    hi = max(hi, hull_center + hull_half);
    pad = pad + V(by.gain) * ((seen.scale * V(by.size) + sum(abs(seen.translation))) + base);
  }
  extent = extent + ((abs(to[0]) + abs(to[1])) + abs(to[2]));
  lo = max(lo, middle - extent);
  hi = min(hi, middle + extent);
  const V half(0.5f);
  const Vec3<V> at = half * (lo + hi), size = half * (hi - lo);
  BoxLanes<V> out = local;
  out.center = local.center + (at.x * local.axis[0] + at.y * local.axis[1] + at.z * local.axis[2]);
  out.half = {max(size.x, zero) + pad, max(size.y, zero) + pad, max(size.z, zero) + pad};
  return out;
}

}  // namespace cab::kernel
