// Pairs of triangles as lanes: whether they are farther apart than a margin, or have a point in common. Both answers
// hold by more than all rounding (docs/proof.md, part 20); a pair in between stays undecided. Triangles are closed, and
// may have no area.
#pragma once

#include "kernels/convex/convex_block.h"
#include "kernels/vec3.h"
#include "layout/error_bounds.h"

namespace cab::kernel {

// Triangles as lanes: the corners of one triangle in each lane.
template <class V>
struct TriangleLanes {
  Vec3<V> corner[3];
};

// One triangle of a pair, without its place.
template <class V>
struct TriangleShape {
  Vec3<V> edge[3];  // from each corner to the next
  V size[3];        // the largest coordinate of each edge
  V largest;        // of these
  Vec3<V> normal;   // edge 0 x edge 1
  V normal_size;    // size 0 times size 1
};

// A pair of triangles. Places are relative to the first corner of a.
template <class V>
struct TrianglePair {
  TriangleShape<V> a, b;
  Vec3<V> corner[3];  // of b
  V away;             // the largest coordinate of these
};

// What bounds of a pair are made of.
template <class V>
struct TriangleSlack {
  V error, margin;  // of the caller, a little larger
  V rounding;       // of a volume, over the size of the product of the two lengths that are known
  V spans;          // of what both triangles span along a product of edges
  V tiny;           // for underflow
};

// The constant for V's precision.
template <class V>
CAB_INLINE V by_precision(float in_float, double in_double) {
  if constexpr (kIsDouble<V>)
    return V(in_double);
  else
    return V(in_float);
}

template <class V>
CAB_INLINE TriangleShape<V> shape_of(const TriangleLanes<V>& triangle) {
  TriangleShape<V> out;
  for (int k = 0; k < 3; ++k) {
    out.edge[k] = triangle.corner[(k + 1) % 3] - triangle.corner[k];
    out.size[k] = max_component(abs(out.edge[k]));
  }
  out.largest = max(max(out.size[0], out.size[1]), out.size[2]);
  out.normal = cross(out.edge[0], out.edge[1]);
  out.normal_size = out.size[0] * out.size[1];
  return out;
}

template <class V>
CAB_INLINE TrianglePair<V> pair_of(const TriangleLanes<V>& a, const TriangleLanes<V>& b) {
  TrianglePair<V> out;
  out.a = shape_of(a);
  out.b = shape_of(b);
  for (int k = 0; k < 3; ++k) out.corner[k] = b.corner[k] - a.corner[0];
  out.away = max_component(max(max(abs(out.corner[0]), abs(out.corner[1])), abs(out.corner[2])));
  return out;
}

template <class V>
CAB_INLINE TriangleSlack<V> slack_of(const TrianglePair<V>& pair, V error, V margin) {
  const V lengths = (pair.a.largest + pair.b.largest) + pair.away;
  const V rounding = by_precision<V>(kTriangleRounding, kTriangleRoundingDouble);
  const V up = by_precision<V>(kTriangleUp, kTriangleUpDouble);
  TriangleSlack<V> out;
  out.error = up * error;
  out.margin = up * margin;
  out.rounding = rounding * (lengths + (error + margin));
  out.tiny = by_precision<V>(kTriangleTiny, kTriangleTinyDouble) * (V(1.0f) + lengths);
  out.spans = rounding * (pair.a.normal_size * pair.b.largest + pair.b.normal_size * pair.a.largest) + out.tiny;
  return out;
}

template <class V>
CAB_INLINE V length_of(const Vec3<V>& v) {
  return sqrt(dot(v, v) + by_precision<V>(kTriangleTiny, kTriangleTinyDouble));
}

// Volumes of tetrahedra, six times each, of corners of both triangles. What a triangle spans along any product of two
// edges is one of them, or a difference of two.
template <class V>
struct TriangleVolumes {
  V heights_of_b[3], heights_of_a[3];  // of the corners of one triangle above the plane of the other
  V edges[3][3];                 // edge i of a and edge j of b: positive if b's passes a's on the side of the product
  V span_of_a[3], span_of_b[3];  // of a along products with edge j of b, and of b along those with edge i of a
};

template <class V>
CAB_INLINE TriangleVolumes<V> volumes_of(const TrianglePair<V>& pair) {
  TriangleVolumes<V> out;
  for (int k = 0; k < 3; ++k) {
    out.span_of_a[k] = dot(pair.a.normal, pair.b.edge[k]);
    out.span_of_b[k] = dot(pair.b.normal, pair.a.edge[k]);
  }
  out.heights_of_b[0] = dot(pair.a.normal, pair.corner[0]);
  out.heights_of_b[1] = out.heights_of_b[0] + out.span_of_a[0];
  out.heights_of_b[2] = out.heights_of_b[0] - out.span_of_a[2];
  out.heights_of_a[0] = V(0.0f) - dot(pair.b.normal, pair.corner[0]);
  out.heights_of_a[1] = out.heights_of_a[0] + out.span_of_b[0];
  out.heights_of_a[2] = out.heights_of_a[0] - out.span_of_b[2];
  for (int j = 0; j < 3; ++j) {
    const Vec3<V> moment = cross(pair.b.edge[j], pair.corner[j]);
    for (int i = 0; i < 3; ++i) out.edges[i][j] = dot(pair.a.edge[i], moment);
    out.edges[1][j] = out.edges[1][j] - out.span_of_a[j];  // edge 1 alone does not pass through the first corner
  }
  return out;
}

template <class V>
CAB_INLINE V least_of(const V (&v)[3]) {
  return min(min(v[0], v[1]), v[2]);
}
template <class V>
CAB_INLINE V most_of(const V (&v)[3]) {
  return max(max(v[0], v[1]), v[2]);
}

// What a gap along a direction needs in addition if there is a margin.
template <bool kHasMargin, class V>
CAB_INLINE V with_margin(V needed, const Vec3<V>& direction, const TriangleSlack<V>& slack) {
  if constexpr (kHasMargin)
    return needed + slack.margin * length_of(direction);
  else
    return needed;
}

// The gap along the normal of a triangle beyond what rounding, error and margin need; heights: of the other's corners.
template <bool kHasMargin, class V>
CAB_INLINE V beyond_plane(const TriangleShape<V>& triangle, const V (&heights)[3], const TriangleSlack<V>& slack) {
  const V needed = (triangle.normal_size * slack.rounding + slack.tiny) + slack.error * sum(abs(triangle.normal));
  return max(least_of(heights), V(-1.0f) * most_of(heights)) - with_margin<kHasMargin>(needed, triangle.normal, slack);
}

// The lanes whose triangles are apart along the normal of one of them, or along a product of an edge of each.
template <bool kHasMargin, class V>
CAB_INLINE Mask<V> apart_by_volumes(const TrianglePair<V>& pair, const TriangleVolumes<V>& volumes,
                                    const TriangleSlack<V>& slack) {
  V beyond = max(beyond_plane<kHasMargin>(pair.a, volumes.heights_of_b, slack),
                 beyond_plane<kHasMargin>(pair.b, volumes.heights_of_a, slack));
  // Along a product of edges each triangle reaches from its edge to its third corner: half of its span about a middle.
  V half_a[3], half_b[3], by_size[3];
  const V half(0.5f), per_size = V(4.0f) * slack.error + slack.rounding;
  for (int k = 0; k < 3; ++k) {
    half_a[k] = half * volumes.span_of_a[k];
    half_b[k] = half * volumes.span_of_b[k];
    by_size[k] = per_size * pair.b.size[k];
  }
  for (int j = 0; j < 3; ++j) {
    const V reach_a = abs(half_a[j]) + slack.spans;
    for (int i = 0; i < 3; ++i) {
      V needed = (reach_a + abs(half_b[i])) + pair.a.size[i] * by_size[j];
      if constexpr (kHasMargin) needed = with_margin<true>(needed, cross(pair.a.edge[i], pair.b.edge[j]), slack);
      beyond = max(beyond, abs(volumes.edges[i][j] + (half_a[j] + half_b[i])) - needed);
    }
  }
  return beyond > V(0.0f);
}

// The lanes in which an edge passes through the inside of the other triangle: its ends are on both sides of the plane,
// and it passes all three edges on one side. Each volume that says so exceeds its bound.
template <class V>
CAB_INLINE Mask<V> touching_by_volumes(const TrianglePair<V>& pair, const TriangleVolumes<V>& volumes,
                                       const TriangleSlack<V>& slack) {
  const V zero(0.0f), two(2.0f);
  const V a = pair.a.largest, b = pair.b.largest, away = a + pair.away;
  const V moved_a = a + two * slack.error, moved_b = b + two * slack.error, error = V(4.0f) * slack.error;
  const V by_edges =
      ((a * b) * slack.rounding + slack.spans) + error * (two * ((moved_a + moved_b) * away) + moved_a * moved_b);
  const V by_a = (pair.a.normal_size * slack.rounding + slack.tiny) + error * (moved_a * (V(4.0f) * away + moved_a));
  const V by_b = (pair.b.normal_size * slack.rounding + slack.tiny) + error * (moved_b * (V(4.0f) * away + moved_b));
  const auto passes = [&](V first, V second, V third, V from, V to, V by_plane) {
    const V least = min(min(first, second), third), most = max(max(first, second), third);
    const V one_side = max(least, V(-1.0f) * most) - by_edges;
    const V both_sides = min(max(from, to), V(-1.0f) * min(from, to)) - by_plane;
    return min(one_side, both_sides);
  };
  V beyond = zero;
  for (int k = 0; k < 3; ++k) {
    const V(&e)[3][3] = volumes.edges;
    const int next = (k + 1) % 3;
    beyond = max(beyond, passes(e[k][0], e[k][1], e[k][2], volumes.heights_of_a[k], volumes.heights_of_a[next], by_b));
    beyond = max(beyond, passes(e[0][k], e[1][k], e[2][k], volumes.heights_of_b[k], volumes.heights_of_b[next], by_a));
  }
  return beyond > zero;
}

// The gap of a pair along any direction beyond what rounding, error and margin need.
template <class V>
CAB_INLINE V beyond_along(const Vec3<V>& direction, const TrianglePair<V>& pair, const TriangleSlack<V>& slack) {
  const V zero(0.0f);
  const V at_a[2] = {dot(direction, pair.a.edge[0]), zero - dot(direction, pair.a.edge[2])};
  const V at_b[3] = {dot(direction, pair.corner[0]), dot(direction, pair.corner[1]), dot(direction, pair.corner[2])};
  const V lo_a = min(min(at_a[0], at_a[1]), zero), hi_a = max(max(at_a[0], at_a[1]), zero);
  const V needed = sum(abs(direction)) * (slack.error + slack.rounding) + slack.tiny;
  return max(least_of(at_b) - hi_a, lo_a - most_of(at_b)) - with_margin<true>(needed, direction, slack);
}

// The lanes whose triangles are apart along a direction in the plane of one of them and across an edge of it: all that
// parts triangles in one plane.
template <class V>
CAB_INLINE Mask<V> apart_in_plane(const TrianglePair<V>& pair, const TriangleSlack<V>& slack) {
  const V zero(0.0f), least = by_precision<V>(kTriangleTiny, kTriangleTinyDouble);
  V beyond = zero;
  for (const TriangleShape<V>* triangle : {&pair.a, &pair.b}) {
    const Vec3<V>& n = triangle->normal;
    const Vec3<V> normal = divide(V(1.0f), max(max_component(abs(n)), least)) * n;
    for (int k = 0; k < 3; ++k) beyond = max(beyond, beyond_along(cross(normal, triangle->edge[k]), pair, slack));
  }
  return beyond > zero;
}

// A weight from 0 to 1: a quotient whose divisor is not negative.
template <class V>
CAB_INLINE V weight_of(V dividend, V divisor) {
  const V by = divide(dividend, max(divisor, by_precision<V>(kTriangleTiny, kTriangleTinyDouble)));
  return max(min(by, V(1.0f)), V(0.0f));
}

// The way from a point of one segment to a point of another: the nearest ones (Ericson 2005, 5.1.9), or nearly. e, f:
// the segments; between: from the beginning of the first to that of the second.
template <class V>
CAB_INLINE Vec3<V> way_of_edges(const Vec3<V>& e, const Vec3<V>& f, const Vec3<V>& between) {
  const V e_sq = dot(e, e), f_sq = dot(f, f), ef = dot(e, f);
  const V along_e = dot(e, between), along_f = dot(f, between);
  V of_e = weight_of(along_e * f_sq - ef * along_f, e_sq * f_sq - ef * ef);
  const V of_f = weight_of(of_e * ef - along_f, f_sq);
  of_e = weight_of(of_f * ef + along_e, e_sq);
  return (between + of_f * f) - of_e * e;
}

// The way to a point from its foot in the plane of a triangle. from: the way from the triangle's first corner to the
// point; inside: the lanes in which the foot is in the triangle.
template <class V>
CAB_INLINE Vec3<V> way_to_face(const TriangleShape<V>& face, V normal_sq, const Vec3<V>& from, Mask<V>& inside) {
  const V zero(0.0f), one(1.0f);
  const Vec3<V> across = cross(face.normal, from);
  const V of_first = zero - dot(across, face.edge[2]), of_second = zero - dot(across, face.edge[0]);
  inside = both(both(of_first > zero, of_second > zero), of_first + of_second < normal_sq);
  const V by = divide(one, normal_sq);
  return (from - (by * of_first) * face.edge[0]) + (by * of_second) * face.edge[2];
}

// The lanes in which a point of a is within the margin of a point of b.
template <class V>
CAB_INLINE Mask<V> near_by_points(const TrianglePair<V>& pair, const TriangleSlack<V>& slack, V margin) {
  const V zero(0.0f), tiny = by_precision<V>(kTriangleTiny, kTriangleTinyDouble);
  const V normal_a_sq = dot(pair.a.normal, pair.a.normal) + tiny,
          normal_b_sq = dot(pair.b.normal, pair.b.normal) + tiny;
  const Vec3<V> origin = {zero, zero, zero};
  const Vec3<V> corners_of_a[3] = {origin, pair.a.edge[0], origin - pair.a.edge[2]};
  V least_sq = V(kFarTriangles);
  const auto take_face = [&least_sq](const TriangleShape<V>& face, V normal_sq, const Vec3<V>& from) {
    Mask<V> inside;
    const Vec3<V> way = way_to_face(face, normal_sq, from, inside);
    least_sq = min(least_sq, select(inside, dot(way, way), V(kFarTriangles)));
  };
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      const Vec3<V> way = way_of_edges(pair.a.edge[i], pair.b.edge[j], pair.corner[j] - corners_of_a[i]);
      least_sq = min(least_sq, dot(way, way));
    }
    take_face(pair.a, normal_a_sq, pair.corner[i]);
    take_face(pair.b, normal_b_sq, corners_of_a[i] - pair.corner[0]);
  }
  const V up = by_precision<V>(kTriangleUp, kTriangleUpDouble);
  return up * sqrt(least_sq + tiny) + (V(2.0f) * slack.error + slack.rounding) < margin;
}

// The answers for the lanes of `active`. error: how far each coordinate of a corner of b less a corner of a may be from
// the truth. Error and margin are 0 to kMaxCoordinate. Pairs of a size beyond what products of three lengths can hold
// stay undecided.
template <class V>
CAB_INLINE ConvexAnswer test_triangles(const TriangleLanes<V>& a, const TriangleLanes<V>& b, V error, V margin,
                                       std::uint32_t active) {
  const TrianglePair<V> pair = pair_of(a, b);
  const V size = max(pair.a.largest, pair.away);
  active &= bits(both(size >= by_precision<V>(kLeastTriangles, kLeastTrianglesDouble),
                      size <= by_precision<V>(kMostTriangles, kMostTrianglesDouble)));
  const TriangleSlack<V> slack = slack_of(pair, error, margin);
  const TriangleVolumes<V> volumes = volumes_of(pair);
  ConvexAnswer answer;
  const bool has_margin = bits(margin > V(0.0f)) != 0;
  answer.apart = active & (has_margin ? bits(apart_by_volumes<true>(pair, volumes, slack))
                                      : bits(apart_by_volumes<false>(pair, volumes, slack)));
  active &= ~answer.apart;
  if (!active) return answer;
  answer.touching = bits(touching_by_volumes(pair, volumes, slack)) & active;
  active &= ~answer.touching;
  if (active && has_margin) {
    const std::uint32_t near = bits(near_by_points(pair, slack, margin)) & active;
    answer.touching |= near;
    active &= ~near;
  }
  if (active) answer.apart |= bits(apart_in_plane(pair, slack)) & active;
  return answer;
}

}  // namespace cab::kernel
