// The distance of two boxes, measured between points of both, so that rounding never makes it too small.
#pragma once

#include "perf/judge/oracle/exact_pose.h"

#include <algorithm>

namespace cab::oracle {

// The point of a box nearest to another point. Axes are taken as orthonormal. If they are not quite orthonormal, the
// point is still a point of the box.
inline Point nearest_in_box(const ExactBox& box, const Point& p) {
  Point out = center_of(box);
  const Point away = p - out;
  for (std::size_t k = 0; k < 3; ++k)
    out = out + std::clamp(dot(away, axis_of(box, k)), -box.half[k], box.half[k]) * axis_of(box, k);
  return out;
}

inline Point corner_of(const ExactBox& box, unsigned corner) {
  Point out = center_of(box);
  for (unsigned k = 0; k < 3; ++k) out = out + (corner >> k & 1 ? box.half[k] : -box.half[k]) * axis_of(box, k);
  return out;
}

// Squared distance of the segments p to p + u and q to q + v (Ericson, Real-Time Collision Detection, 5.1.9).
inline Real segment_distance_sq(const Point& p, const Point& u, const Point& q, const Point& v) {
  const Point w = p - q;
  const Real a = dot(u, u), e = dot(v, v), f = dot(v, w), c = dot(u, w), b = dot(u, v);
  const Real scale = a * e - b * b;
  Real s = scale > 0 ? std::clamp((b * f - c * e) / scale, Real{0}, Real{1}) : 0;
  const Real t = e > 0 ? std::clamp((b * s + f) / e, Real{0}, Real{1}) : 0;
  s = a > 0 ? std::clamp((b * t - c) / a, Real{0}, Real{1}) : 0;
  const Point between = w + s * u - t * v;
  return dot(between, between);
}

// The distance of two boxes; 0 if they overlap. between: the centre of b less the centre of a.
inline Real box_distance(ExactBox a, ExactBox b, const Point& between) {
  if (exactly_overlap(a, b, between)) return 0;
  store(Point{}, a.center);
  store(between, b.center);
  Real least = dot(between, between);
  const auto take = [&least](Real distance_sq) { least = std::min(least, distance_sq); };
  for (unsigned corner = 0; corner < 8; ++corner) {
    const Point of_a = corner_of(a, corner), of_b = corner_of(b, corner);
    const Point to_b = of_a - nearest_in_box(b, of_a), to_a = of_b - nearest_in_box(a, of_b);
    take(dot(to_b, to_b));
    take(dot(to_a, to_a));
  }
  for (unsigned edge_a = 0; edge_a < 12; ++edge_a)
    for (unsigned edge_b = 0; edge_b < 12; ++edge_b) {
      // An edge along axis k begins at a corner whose bit k is 0.
      const auto begin = [](unsigned edge) {
        const unsigned k = edge / 4, low = edge % 4 & ((1u << k) - 1), high = edge % 4 >> k;
        return low | high << (k + 1);
      };
      const auto along = [](const ExactBox& box, unsigned edge) {
        return 2 * box.half[edge / 4] * axis_of(box, edge / 4);
      };
      take(segment_distance_sq(corner_of(a, begin(edge_a)), along(a, edge_a), corner_of(b, begin(edge_b)),
                               along(b, edge_b)));
    }
  return std::sqrt(least);
}

}  // namespace cab::oracle
