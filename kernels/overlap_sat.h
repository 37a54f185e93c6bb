// The overlap test of two boxes: fifteen separating axes with slack, and the leaf predicate.
#pragma once

#include "kernels/box.h"
#include "kernels/merge_aabb.h"
#include "layout/error_bounds.h"

#include <cab/policy.h>

namespace cab::kernel {

// Lanes in which an axis that kSat names separates a and b. between: the centre of b less the centre of a. The test
// enlarges both boxes a little, which gives each axis a slack in proportion to its length. edge_slack covers the
// rounding of products that should be zero. Comparisons are written so that a NaN never separates.
template <Sat kSat, class V>
CAB_INLINE Mask<V> separated(const BoxLanes<V>& a, const BoxLanes<V>& b, Vec3<V> between) {
  const V grow = V(kSlackGrow) * ((sum(a.half) + sum(b.half)) + V(kOverlapTiny));
  const V half_a[3] = {a.half.x + grow, a.half.y + grow, a.half.z + grow};
  const V half_b[3] = {b.half.x + grow, b.half.y + grow, b.half.z + grow};
  const V edge_slack = V(kSlackEdge) * (half_b[0] + half_b[1] + half_b[2]);

  V r[3][3], r_abs[3][3], t[3];  // r = A^T B, t = between in a's axes
  for (int i = 0; i < 3; ++i) {
    t[i] = dot(a.axis[i], between);
    for (int j = 0; j < 3; ++j) {
      r[i][j] = dot(a.axis[i], b.axis[j]);
      r_abs[i][j] = abs(r[i][j]);
    }
  }

  Mask<V> out = abs(t[0]) > half_a[0] + (half_b[0] * r_abs[0][0] + half_b[1] * r_abs[0][1] + half_b[2] * r_abs[0][2]);
  for (int i = 1; i < 3; ++i)
    out = either(out,
                 abs(t[i]) > half_a[i] + (half_b[0] * r_abs[i][0] + half_b[1] * r_abs[i][1] + half_b[2] * r_abs[i][2]));
  for (int j = 0; j < 3; ++j)
    out = either(out, abs(dot(b.axis[j], between)) >
                          half_b[j] + (half_a[0] * r_abs[0][j] + half_a[1] * r_abs[1][j] + half_a[2] * r_abs[2][j]));
  if constexpr (kSat == Sat::kFaces6) return out;
  for (int i = 0; i < 3; ++i) {
    const int i1 = (i + 1) % 3, i2 = (i + 2) % 3;
    for (int j = 0; j < 3; ++j) {
      const int j1 = (j + 1) % 3, j2 = (j + 2) % 3;
      const V reached = (half_a[i1] * r_abs[i2][j] + half_a[i2] * r_abs[i1][j]) +
                        (half_b[j1] * r_abs[i][j2] + half_b[j2] * r_abs[i][j1]);
      out = either(out, abs(t[i2] * r[i1][j] - t[i1] * r[i2][j]) > reached + edge_slack);
    }
  }
  return out;
}

// Lanes in which a world axis separates a and b.
template <class V>
CAB_INLINE Mask<V> separated_in_world(const BoxLanes<V>& a, const BoxLanes<V>& b, Vec3<V> between) {
  const V slack = V(kSlackWorld) * ((sum(a.half) + sum(b.half)) + V(kOverlapTiny));
  const Vec3<V> out = world_half_extents(a) + world_half_extents(b);
  const Vec3<V> away = abs(between);
  return either(either(away.x > out.x + slack, away.y > out.y + slack), away.z > out.z + slack);
}

// The centre of b less the centre of a. shift: the origins of b less the origins of a, or null if they are equal.
template <class V>
CAB_INLINE Vec3<V> between_centers(const BoxLanes<V>& a, const BoxLanes<V>& b, const ShiftTile* shift,
                                   std::uint32_t lane) {
  if (!shift) return b.center - a.center;
  return {difference(b.center.x, a.center.x, shift->by[0] + lane),
          difference(b.center.y, a.center.y, shift->by[1] + lane),
          difference(b.center.z, a.center.z, shift->by[2] + lane)};
}

// Lanes in which two bounds, each relative to its own origin, do not overlap. x, y, z: the origin of b less the origin
// of a along each axis, one double per lane, or null if the origins are equal.
template <class V>
CAB_INLINE Mask<V> bounds_apart(const AabbLanes<V>& a, const AabbLanes<V>& b, const double* x, const double* y,
                                const double* z) {
  const V zero(0.0f);
  if (!x)
    return either(either(either(b.lo.x > a.hi.x, b.lo.y > a.hi.y), b.lo.z > a.hi.z),
                  either(either(a.lo.x > b.hi.x, a.lo.y > b.hi.y), a.lo.z > b.hi.z));
  const Mask<V> above = either(either(difference(b.lo.x, a.hi.x, x) > zero, difference(b.lo.y, a.hi.y, y) > zero),
                               difference(b.lo.z, a.hi.z, z) > zero);
  const Mask<V> below = either(either(difference(b.hi.x, a.lo.x, x) < zero, difference(b.hi.y, a.lo.y, y) < zero),
                               difference(b.hi.z, a.lo.z, z) < zero);
  return either(above, below);
}

}  // namespace cab::kernel
