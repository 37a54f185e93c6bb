// GJK (Gilbert, Johnson, Keerthi 1988) with pairs as lanes: whether the difference of two shapes, a - b, contains the
// origin. Only a plane says apart, and only a tetrahedron about the origin or a short vector says touching; both by
// more than the slack. A pair in between stays undecided.
#pragma once

#include "kernels/convex/pair_lanes.h"
#include "kernels/convex/support.h"

namespace cab::kernel {

// When GJK gives up: after this many support points, or when a step shortens the square of the distance by less than
// this share. any: at the first lane that touches too.
struct GjkLimits {
  std::uint32_t steps;
  double progress;
  bool any = false;
};
inline constexpr GjkLimits kGjkInFloat = {24, kGjkProgress}, kGjkInDouble = {200, kGjkProgressDouble};

// Where a corner of a simplex is. Corners are points of the difference, or carry such a point and more.
template <class V>
CAB_INLINE const Vec3<V>& place_of(const Vec3<V>& corner) {
  return corner;
}

// A triangle or what is left of one: three corners, of which some may be equal.
template <class V, class Corner = Vec3<V>>
struct Simplex {
  Corner corner[3];
  Vec3<V> normal;  // from the origin to the closest point of the feature, made so that its direction is exact
  V length_sq;     // of the way from the origin to a point of the simplex, made so that the point is in it

  CAB_INLINE void set(const Corner& all) {
    for (Corner& one : corner) one = all;
    normal = place_of(all);
    length_sq = dot(normal, normal);
  }
};

// The corners of a feature.
template <class Corner>
struct Feature {
  const Corner &p, &q, &r;
};

// What is left of v across an edge. v is across it but for rounding, which is large next to a short v: without this,
// the plane through a feature that is close to the origin cuts off the feature's own corners. In float that happens
// within the slack, and v is kept.
template <class V>
CAB_INLINE Vec3<V> across(const Vec3<V>& v, const Vec3<V>& edge, V length_sq) {
  if constexpr (!kIsDouble<V>) return v;
  return v - divide(dot(v, edge), length_sq) * edge;
}

// Takes a feature as the new simplex in the lanes where it is nearer to the origin. closest: the point of the feature
// that is nearest to the origin.
template <class V, class Corner>
CAB_INLINE void take_nearer(const Vec3<V>& closest, const Vec3<V>& normal, Mask<V> valid,
                            const Feature<Corner>& feature, Simplex<V, Corner>& best) {
  const V length_sq = dot(closest, closest);
  const Mask<V> nearer = both(valid, length_sq < best.length_sq);
  take<V>(nearer, length_sq, best.length_sq);
  take<V>(nearer, normal, best.normal);
  take<V>(nearer, feature.p, best.corner[0]);
  take<V>(nearer, feature.q, best.corner[1]);
  take<V>(nearer, feature.r, best.corner[2]);
}

// Adds a corner to a simplex: `best` receives the feature nearest to the origin, of all features of the tetrahedron
// that contain the new corner. Returns the lanes in which the tetrahedron contains all points within `inside` of the
// origin. rounding: of a product of three edges.
template <class V, class Corner>
CAB_INLINE Mask<V> add_point(const Corner& added, V inside, V rounding, const Simplex<V, Corner>& simplex,
                             Simplex<V, Corner>& best) {
  const V zero(0.0f), one(1.0f);
  const Vec3<V>& p = place_of(added);
  const Vec3<V> to_origin = {zero - p.x, zero - p.y, zero - p.z};
  Vec3<V> edge[3], normal[3];
  V height[3], normal_sq[3];  // of the faces through p: height is the product of three edges
  for (int i = 0; i < 3; ++i) edge[i] = place_of(simplex.corner[i]) - p;
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

  best.set(added);
  V length_sq[3];
  for (int i = 0; i < 3; ++i) {
    length_sq[i] = dot(edge[i], edge[i]);
    const V along = divide(dot(to_origin, edge[i]), length_sq[i]);
    const Vec3<V> closest = p + along * edge[i];
    const Feature<Corner> feature = {added, simplex.corner[i], simplex.corner[i]};
    take_nearer<V, Corner>(closest, across(closest, edge[i], length_sq[i]), both(along > zero, along < one), feature,
                           best);
  }
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3;
    // The weights of both corners, times normal_sq. Where they are positive, the origin is above the face.
    const V weight_i = dot(cross(to_origin, edge[j]), normal[i]), weight_j = dot(cross(edge[i], to_origin), normal[i]);
    const Mask<V> above = both(both(weight_i > zero, weight_j > zero), weight_i + weight_j < normal_sq[i]);
    const V by = divide(V(1.0f), normal_sq[i]);
    const Vec3<V> closest = p + ((by * weight_i) * edge[i] + (by * weight_j) * edge[j]);
    const Feature<Corner> feature = {added, simplex.corner[i], simplex.corner[j]};
    take_nearer<V, Corner>(closest, across(((zero - height[i]) * by) * normal[i], edge[i], length_sq[i]), above,
                           feature, best);
  }
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

// The square of the length below which the support along a direction may be off. Where shapes are apart, v is no
// shorter than their distance, but for rounding: in double a plane may be worth more than the length of its v.
template <class V>
CAB_INLINE V least_direction_sq(V apart_sq) {
  if constexpr (kIsDouble<V>) return kLeastDirectionSqDouble;
  return apart_sq;
}

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
  Simplex<V> simplices[2];  // the last step's and this step's
  for (std::uint32_t step = 0; step < limits.steps; ++step) {
    active &= bits(v_sq > zero);  // the origin is a point of the difference, or a lane holds a NaN
    if (!active) break;
    const Vec3<V> p = support(Vec3<V>{zero - v.x, zero - v.y, zero - v.z}, active);
    const V gap = dot(v, p);
    const V apart_sq = apart_from * apart_from;
    const Mask<V> has_support = v_sq > least_direction_sq(apart_sq);
    const std::uint32_t apart = bits(both(both(gap > zero, has_support), gap * gap > apart_sq * v_sq)) & active;
    answer.apart |= apart;
    active &= ~apart;
    Mask<V> contains = zero < zero;
    Simplex<V>& simplex = simplices[step % 2];
    if (step == 0) {
      simplex.set(p);
    } else {
      active &= ~bits(v_sq - gap <= progress * v_sq);
      if (!active) break;
      contains = add_point(p, pair.slack, pair.rounding, simplices[1 - step % 2], simplex);
    }
    v = simplex.normal;
    v_sq = dot(v, v);
    const Mask<V> near = both(touch_to > zero, simplex.length_sq < touch_to * touch_to);
    const std::uint32_t touching = bits(either(contains, near)) & active;
    answer.touching |= touching;
    active &= ~touching;
    if (limits.any && touching) break;
  }
  return answer;
}

}  // namespace cab::kernel
