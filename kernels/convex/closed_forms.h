// Pairs of convex shapes with an answer in closed form: round shapes (spheres and capsules), ellipsoids, boxes, and any
// shape with a half space. As in gjk.h only a plane says apart, and both answers hold by more than the slack.
#pragma once

#include "kernels/convex/pair_lanes.h"
#include "kernels/convex/support.h"

namespace cab::kernel {

// --------------------------------------------------------------------------------------------------- round shapes

template <class V>
CAB_INLINE V clamped(V v, V limit) {
  return max(min(v, limit), V(0.0f) - limit);
}

// Closest points of two segments (Ericson 2005, 5.1.9), then the plane between them.
template <class V>
CAB_INLINE ConvexAnswer round_pairs(const PairLanes<V>& pair, V margin) {
  const V one(1.0f), zero(0.0f);
  const V half_a = pair.size_a.z, half_b = pair.size_b.z;
  const Vec3<V>& axis = pair.column[2];  // of b; that of a is z
  const V t_axis = dot(pair.t, axis);
  const V sine_sq = one - axis.z * axis.z;
  V s = divide(pair.t.z - axis.z * t_axis, sine_sq);
  s = clamped(select(sine_sq > V(kParallelSegments), s, zero), half_a);
  V r = clamped(s * axis.z - t_axis, half_b);
  s = clamped(pair.t.z + r * axis.z, half_a);
  r = clamped(s * axis.z - t_axis, half_b);
  Vec3<V> n = pair.t + r * axis;
  n.z = n.z - s;
  const V length = sqrt(dot(n, n));
  const V radius = (pair.size_a.x + pair.size_b.x) + margin;
  const V gap = dot(n, pair.t) - (abs(n.z) * half_a + abs(dot(n, axis)) * half_b);
  // A length within the slack says nothing: its square may have underflowed.
  return {bits(both(length > pair.slack, gap > (radius + pair.slack) * length)), bits(length < radius - pair.slack)};
}

// ----------------------------------------------------------------------------------------------------- ellipsoids

inline constexpr int kEllipsoidSteps = 12;

// Perram and Wertheim 1985: for a weight w between 0 and 1, v solves ((1 - w) A + w B) v = t, where A and B are the
// matrices of the ellipsoids. v is the normal of a plane that may separate them, and (1 - w) A v is a point that may be
// in both. At the w with equal (1 - w) |v|_A and w |v|_B one of the two holds.
template <class V>
CAB_INLINE ConvexAnswer ellipsoid_pairs(const PairLanes<V>& pair, std::uint32_t active) {
  const V one(1.0f), zero(0.0f);
  const Vec3<V>&a = pair.size_a, &b = pair.size_b, &t = pair.t;
  const V a_xx = a.x * a.x, a_yy = a.y * a.y, a_zz = a.z * a.z;
  const Vec3<V> b_sq = {b.x * b.x, b.y * b.y, b.z * b.z};
  const auto entry = [&](V Vec3<V>::*r, V Vec3<V>::*c) {
    return (b_sq.x * (pair.column[0].*r) * (pair.column[0].*c) + b_sq.y * (pair.column[1].*r) * (pair.column[1].*c)) +
           b_sq.z * (pair.column[2].*r) * (pair.column[2].*c);
  };
  const V b_xx = entry(&Vec3<V>::x, &Vec3<V>::x), b_yy = entry(&Vec3<V>::y, &Vec3<V>::y),
          b_zz = entry(&Vec3<V>::z, &Vec3<V>::z), b_xy = entry(&Vec3<V>::x, &Vec3<V>::y),
          b_xz = entry(&Vec3<V>::x, &Vec3<V>::z), b_yz = entry(&Vec3<V>::y, &Vec3<V>::z);
  const V least_a = min(min(a.x, a.y), a.z), least_b = min(min(b.x, b.y), b.z);

  ConvexAnswer answer;
  V low = zero, high = one;
  Vec3<V> v = t;
  for (int step = 0;; ++step) {
    // How far each ellipsoid reaches along v, times |v|.
    const Vec3<V> in_a = {a.x * v.x, a.y * v.y, a.z * v.z};
    const Vec3<V> in_b = {b.x * dot(pair.column[0], v), b.y * dot(pair.column[1], v), b.z * dot(pair.column[2], v)};
    const V reach_a = sqrt(dot(in_a, in_a)), reach_b = sqrt(dot(in_b, in_b));
    const std::uint32_t apart = bits(dot(v, t) > (reach_a + reach_b) + pair.slack * sqrt(dot(v, v))) & active;
    answer.apart |= apart;
    active &= ~apart;
    if (!active || step == kEllipsoidSteps) return answer;

    V w = divide(reach_a, reach_a + reach_b);
    w = select(both(w > low, w < high), w, V(0.5f) * (low + high));
    const V w_a = one - w;
    const V xx = w_a * a_xx + w * b_xx, yy = w_a * a_yy + w * b_yy, zz = w_a * a_zz + w * b_zz;
    const V xy = w * b_xy, xz = w * b_xz, yz = w * b_yz;
    const V c_xx = yy * zz - yz * yz, c_xy = xz * yz - xy * zz, c_xz = xy * yz - xz * yy;
    const V c_yy = xx * zz - xz * xz, c_yz = xy * xz - xx * yz, c_zz = xx * yy - xy * xy;
    const V by = divide(one, (xx * c_xx + xy * c_xy) + xz * c_xz);
    v = {by * ((c_xx * t.x + c_xy * t.y) + c_xz * t.z), by * ((c_xy * t.x + c_yy * t.y) + c_yz * t.z),
         by * ((c_xz * t.x + c_yz * t.y) + c_zz * t.z)};

    // Points of both shapes, in which v is normal to them, shrunk to those of weight w.
    const Vec3<V> of_b = {dot(pair.column[0], v), dot(pair.column[1], v), dot(pair.column[2], v)};
    const Vec3<V> on_b = {w * (b_sq.x * of_b.x), w * (b_sq.y * of_b.y), w * (b_sq.z * of_b.z)};
    const Vec3<V> point_a = {w_a * (a_xx * v.x), w_a * (a_yy * v.y), w_a * (a_zz * v.z)};
    const Vec3<V> off = (point_a + rotate(pair.column, on_b)) - t;
    const V a_v = w_a * sqrt(a_xx * v.x * v.x + (a_yy * v.y * v.y + a_zz * v.z * v.z));
    const V b_v = w * sqrt(b_sq.x * of_b.x * of_b.x + (b_sq.y * of_b.y * of_b.y + b_sq.z * of_b.z * of_b.z));
    const V miss = sqrt(dot(off, off)) + pair.slack;
    const V inside = one - V(kEllipsoidInside);
    const Mask<V> touch = either(both(miss < (inside - a_v) * least_a, b_v < inside),
                                 both(miss < (inside - b_v) * least_b, a_v < inside));
    const std::uint32_t touching = bits(touch) & active;
    answer.touching |= touching;
    active &= ~touching;
    const Mask<V> raise = a_v > b_v;
    low = select(raise, w, low);
    high = select(raise, high, w);
  }
}

// ---------------------------------------------------------------------------------------------------------- boxes

// The fifteen axes of two boxes (Gottschalk, Lin, Manocha 1996).
template <class V>
CAB_INLINE ConvexAnswer box_pairs(const PairLanes<V>& pair) {
  const V half_a[3] = {pair.size_a.x, pair.size_a.y, pair.size_a.z};
  const V half_b[3] = {pair.size_b.x, pair.size_b.y, pair.size_b.z};
  const V t[3] = {pair.t.x, pair.t.y, pair.t.z};
  V r[3][3], r_abs[3][3];  // r[i][j]: component i of axis j of b
  for (int j = 0; j < 3; ++j) {
    r[0][j] = pair.column[j].x;
    r[1][j] = pair.column[j].y;
    r[2][j] = pair.column[j].z;
    for (int i = 0; i < 3; ++i) r_abs[i][j] = abs(r[i][j]);
  }
  const V none(-8.0f);                                // below any gap, for reaches add up to less than 1
  V faces = none, edges = none, least_sine_sq(1.0f);  // the widest gaps, and how parallel two edges are
  for (int i = 0; i < 3; ++i)
    faces = max(
        faces, abs(t[i]) - (half_a[i] + (half_b[0] * r_abs[i][0] + half_b[1] * r_abs[i][1] + half_b[2] * r_abs[i][2])));
  for (int j = 0; j < 3; ++j)
    faces = max(faces, abs(dot(pair.column[j], pair.t)) -
                           (half_b[j] + (half_a[0] * r_abs[0][j] + half_a[1] * r_abs[1][j] + half_a[2] * r_abs[2][j])));
  for (int i = 0; i < 3; ++i) {
    const int i1 = (i + 1) % 3, i2 = (i + 2) % 3;
    for (int j = 0; j < 3; ++j) {
      const int j1 = (j + 1) % 3, j2 = (j + 2) % 3;
      const V reached = (half_a[i1] * r_abs[i2][j] + half_a[i2] * r_abs[i1][j]) +
                        (half_b[j1] * r_abs[i][j2] + half_b[j2] * r_abs[i][j1]);
      edges = max(edges, abs(t[i2] * r[i1][j] - t[i1] * r[i2][j]) - reached);
      least_sine_sq = min(least_sine_sq, r[i1][j] * r[i1][j] + r[i2][j] * r[i2][j]);
    }
  }
  const V deep = V(0.0f) - (V(kBoxDepth) * (sum(abs(pair.t)) + pair.reach) + pair.slack);
  // If two edges are parallel, the faces are all axes.
  const Mask<V> overlap = both(faces < deep, either(edges < deep, least_sine_sq <= V(kParallelEdges)));
  return {bits(max(faces, edges) > pair.slack), bits(overlap)};
}

// ---------------------------------------------------------------------------------------------------- half spaces

// The lowest point of a shape above the plane of a half space. Two half spaces touch. radius: of both balls, and the
// margin.
template <class V>
CAB_INLINE ConvexAnswer half_space_pairs(const Difference<V>& shapes, V slack, V radius) {
  constexpr std::uint32_t kAll = (1u << kWidth<V>)-1;
  const V zero(0.0f);
  V height;
  if (shapes.a.kind != ConvexKind::kHalfSpace) {
    const Vec3<V>& up = shapes.column[2];
    height = dot(up, support(shapes.a, {zero - up.x, zero - up.y, zero - up.z}, kAll) - shapes.t);
  } else if (shapes.b.kind != ConvexKind::kHalfSpace) {
    height = shapes.farthest_of_b({zero, zero, V(-1.0f)}, kAll).z;
  } else {
    return {0, kAll};
  }
  return {bits(height > radius + slack), bits(height < radius - slack)};
}

}  // namespace cab::kernel
