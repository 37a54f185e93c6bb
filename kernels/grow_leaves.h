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
// the same axes. relatives: by LeafInfluence::relative.
//
// Two boxes hold the vertices, and the result is what they have in common. One takes each link's weight for a linear
// function of the place, and adds what that leaves out. The other is about the boxes of what each link moves.
template <class V>
CAB_INLINE BoxLanes<V> grow_box(const BoxLanes<V>& local, Span<const LeafInfluence> influences, const OwnVertices& own,
                                const MotionTile* relatives, std::uint32_t lane) {
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
    const RigidLanes<V> seen = load_motion<V>(relatives[by.relative], lane);
    const auto turn = [&](const float(&v)[3]) {
      return V(v[0]) * seen.column[0] + V(v[1]) * seen.column[1] + V(v[2]) * seen.column[2];
    };
    const Vec3<V> moved = along((seen.translation + turn(by.center)) - local.center);
    middle = middle + V(by.weight) * moved;
    extent = extent + V(by.slack) * abs(moved);
    Vec3<V> hull_center = moved, hull_half = none;
    for (int k = 0; k < 3; ++k) {
      const Vec3<V> edge = along(turn(by.edge[k]));
      Vec3<V> bent = edge;
      if (k == 0) bent.x = bent.x - local.half.x;
      if (k == 1) bent.y = bent.y - local.half.y;
      if (k == 2) bent.z = bent.z - local.half.z;
      to[k] = to[k] + (V(by.slope[k]) * moved + V(by.weight) * bent);
      middle = middle + V(by.bent_center[k]) * bent;
      extent = extent + V(by.bent_half[k]) * abs(bent);
      hull_center = hull_center + V(by.moved_center[k]) * edge;
      hull_half = hull_half + V(by.moved_half[k]) * abs(edge);
    }
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
