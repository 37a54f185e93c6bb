// GJK (Gilbert, Johnson, Keerthi 1988) with pairs as lanes: whether the difference of two shapes, a - b, contains the
// origin. Only a plane says apart, and only a tetrahedron about the origin or a short vector says touching; both by
// more than the slack. A pair in between stays undecided.
#pragma once

#include "kernels/convex/pair_lanes.h"
#include "kernels/convex/support.h"

namespace cab::kernel {

// When GJK gives up: after this many support points, or when a step shortens the square of the distance by less than
// this share.
struct GjkLimits {
  std::uint32_t steps;
  double progress;
};
inline constexpr GjkLimits kGjkInFloat = {24, kGjkProgress}, kGjkInDouble = {200, kGjkProgressDouble};

// The difference of the two shapes of each lane, in the frame of a.
template <class V>
struct Difference {
  SupportShape<V> a, b;
  Vec3<V> column[3];  // the axes of b
  Vec3<V> t;          // its centre

  // The point of a - b farthest along d.
  CAB_INLINE Vec3<V> farthest(const Vec3<V>& d, std::uint32_t active) const {
    const V zero(0.0f);
    const Vec3<V> minus = {zero - d.x, zero - d.y, zero - d.z};
    const Vec3<V> on_a = support(a, d, active);
    const Vec3<V> on_b = support(b, {dot(column[0], minus), dot(column[1], minus), dot(column[2], minus)}, active);
    return on_a - (t + rotate(column, on_b));
  }
};

// A triangle or what is left of one: three corners, of which some may be equal.
template <class V>
struct Simplex {
  Vec3<V> corner[3];
  Vec3<V> normal;  // from the origin to the closest point of the feature, made so that its direction is exact
  V length_sq;     // of the way from the origin to a point of the simplex, made so that the point is in it
};

// What is left of v across an edge. v is across it but for rounding, which is large next to a short v: without this,
// the plane through a feature that is close to the origin cuts off the feature's own corners. In float that happens
// within the slack, and v is kept.
template <class V>
CAB_INLINE Vec3<V> across(const Vec3<V>& v, const Vec3<V>& edge, V length_sq) {
  if constexpr (sizeof(horizontal_max(v.x)) == sizeof(float)) return v;
  return v - divide(dot(v, edge), length_sq) * edge;
}

// Takes a feature as the new simplex in the lanes where it is nearer to the origin.
template <class V>
CAB_INLINE void take_nearer(const Vec3<V>& closest, const Vec3<V>& normal, Mask<V> valid, const Vec3<V>& p,
                            const Vec3<V>& q, const Vec3<V>& r, Simplex<V>& best) {
  const V length_sq = dot(closest, closest);
  const Mask<V> nearer = both(valid, length_sq < best.length_sq);
  best.length_sq = select(nearer, length_sq, best.length_sq);
  best.normal = choose<V>(nearer, normal, best.normal);
  best.corner[0] = choose<V>(nearer, p, best.corner[0]);
  best.corner[1] = choose<V>(nearer, q, best.corner[1]);
  best.corner[2] = choose<V>(nearer, r, best.corner[2]);
}

// Adds a point to a simplex: of all features of the tetrahedron that contain the new point, the one nearest to the
// origin becomes the simplex. Returns the lanes in which the tetrahedron contains all points within `inside` of the
// origin. rounding: of a product of three edges.
template <class V>
CAB_INLINE Mask<V> add_point(const Vec3<V>& p, V inside, V rounding, Simplex<V>& simplex) {
  const V zero(0.0f), one(1.0f);
  const Vec3<V> to_origin = {zero - p.x, zero - p.y, zero - p.z};
  Vec3<V> edge[3], normal[3];
  V height[3], normal_sq[3];  // of the faces through p: height is the product of three edges
  for (int i = 0; i < 3; ++i) edge[i] = simplex.corner[i] - p;
  for (int i = 0; i < 3; ++i) {
    normal[i] = cross(edge[i], edge[(i + 1) % 3]);
    height[i] = dot(to_origin, normal[i]);
    normal_sq[i] = dot(normal[i], normal[i]);
  }

  const V volume = dot(edge[2], normal[0]);
  const auto is_inside = [&](V h, V length_sq) {
    const V signed_height = with_sign(h, volume) - rounding;
    return both(signed_height > zero, signed_height * signed_height > inside * inside * length_sq);
  };
  const Vec3<V> opposite = (normal[0] + normal[1]) + normal[2];
  Mask<V> contains = is_inside(volume - ((height[0] + height[1]) + height[2]), dot(opposite, opposite));
  for (int i = 0; i < 3; ++i) contains = both(contains, is_inside(height[i], normal_sq[i]));

  Simplex<V> best = {{p, p, p}, p, dot(p, p)};
  V length_sq[3];
  for (int i = 0; i < 3; ++i) {
    length_sq[i] = dot(edge[i], edge[i]);
    const V along = divide(dot(to_origin, edge[i]), length_sq[i]);
    const Vec3<V> closest = p + along * edge[i];
    take_nearer<V>(closest, across(closest, edge[i], length_sq[i]), both(along > zero, along < one), p,
                   simplex.corner[i], simplex.corner[i], best);
  }
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3;
    // The weights of both corners, times normal_sq. Where they are positive, the origin is above the face.
    const V weight_i = dot(cross(to_origin, edge[j]), normal[i]), weight_j = dot(cross(edge[i], to_origin), normal[i]);
    const Mask<V> above = both(both(weight_i > zero, weight_j > zero), weight_i + weight_j < normal_sq[i]);
    const V by = divide(V(1.0f), normal_sq[i]);
    const Vec3<V> closest = p + ((by * weight_i) * edge[i] + (by * weight_j) * edge[j]);
    take_nearer<V>(closest, across(((zero - height[i]) * by) * normal[i], edge[i], length_sq[i]), above, p,
                   simplex.corner[i], simplex.corner[j], best);
  }
  simplex = best;
  return contains;
}

// What GJK needs to know of a pair besides its support function. Lengths are scaled.
template <class V>
struct GjkPair {
  Vec3<V> t;   // the centre of b's shape less that of a's
  V radius;    // of the ball that is added to both shapes together
  V slack;     // PairLanes::slack
  V rounding;  // of a product of three edges
};

// The answer for the lanes of V. support(d, active) returns the point of a - b farthest along d, without the ball.
template <class V, class Support>
CAB_INLINE ConvexAnswer gjk(const GjkPair<V>& pair, const GjkLimits& limits, std::uint32_t active, Support&& support) {
  const V zero(0.0f), progress(static_cast<decltype(horizontal_max(zero))>(limits.progress));
  const V apart_from = pair.radius + pair.slack, touch_to = pair.radius - pair.slack;
  ConvexAnswer answer;
  // From b's centre towards a's; along x where they coincide.
  Vec3<V> v = {zero - pair.t.x, zero - pair.t.y, zero - pair.t.z};
  v = choose<V>(dot(v, v) > zero, v, {V(1.0f), zero, zero});
  V v_sq = dot(v, v);
  Simplex<V> simplex = {};
  for (std::uint32_t step = 0; step < limits.steps; ++step) {
    active &= bits(v_sq > zero);  // the origin is a point of the difference, or a lane holds a NaN
    if (!active) break;
    const Vec3<V> p = support(Vec3<V>{zero - v.x, zero - v.y, zero - v.z}, active);
    const V gap = dot(v, p);
    const std::uint32_t apart = bits(both(gap > zero, gap * gap > apart_from * apart_from * v_sq)) & active;
    answer.apart |= apart;
    active &= ~apart;
    Mask<V> contains = zero < zero;
    if (step == 0) {
      simplex = {{p, p, p}, p, dot(p, p)};
    } else {
      active &= ~bits(v_sq - gap <= progress * v_sq);
      if (active) contains = add_point(p, pair.slack, pair.rounding, simplex);
    }
    v = simplex.normal;
    v_sq = dot(v, v);
    const Mask<V> near = both(touch_to > zero, simplex.length_sq < touch_to * touch_to);
    const std::uint32_t touching = bits(either(contains, near)) & active;
    answer.touching |= touching;
    active &= ~touching;
  }
  return answer;
}

}  // namespace cab::kernel
