// Whether two triangles have a point in common, and how far apart they are. A point where an edge passes through the
// plane of the other triangle is looked for in that plane: no axis is tried, and no volume of two edges taken. With
// integers the first answer is exact.
#pragma once

#include "perf/judge/oracle/real.h"

#include <algorithm>
#include <cmath>

namespace cab::oracle {

// Wide enough for corners of 21 bits: the longest chain of products below has 111.
__extension__ typedef __int128 Wide;

// Closed; of any shape, a segment or a point too.
template <class T>
struct Triangle {
  Vec3<T> corner[3];
};

template <class T>
int sign_of(const T& v) {
  return v < T(0) ? -1 : v > T(0) ? 1 : 0;
}

template <class T>
bool is_zero(const Vec3<T>& v) {
  return v[0] == T(0) && v[1] == T(0) && v[2] == T(0);
}

// Whether p is on the segment from a to b.
template <class T>
bool on_segment(const Vec3<T>& p, const Vec3<T>& a, const Vec3<T>& b) {
  return is_zero(cross(b - a, p - a)) && dot(p - a, p - b) <= T(0);
}

template <class T>
bool segments_meet(const Vec3<T>& p, const Vec3<T>& q, const Vec3<T>& r, const Vec3<T>& s) {
  const Vec3<T> d = q - p, e = s - r, between = r - p, across = cross(d, e);
  if (is_zero(across))  // on one line, or not at all
    return on_segment(p, r, s) || on_segment(q, r, s) || on_segment(r, p, q) || on_segment(s, p, q);
  if (dot(between, across) != T(0)) return false;
  const T t = dot(cross(between, e), across), u = dot(cross(between, d), across), all = dot(across, across);
  return t >= T(0) && t <= all && u >= T(0) && u <= all;
}

// Whether point / weight is in a triangle with this normal, in whose plane it is. weight > 0.
template <class T>
bool in_triangle(const Vec3<T>& point, const T& weight, const Triangle<T>& triangle, const Vec3<T>& normal) {
  std::size_t axis = 0;
  for (std::size_t k = 1; k < 3; ++k)
    if (magnitude(normal[k]) > magnitude(normal[axis])) axis = k;
  const std::size_t x = (axis + 1) % 3, y = (axis + 2) % 3;
  bool has_left = false, has_right = false;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3<T>&a = triangle.corner[k], &b = triangle.corner[(k + 1) % 3];
    const int side = sign_of((b[x] - a[x]) * (point[y] - weight * a[y]) - (b[y] - a[y]) * (point[x] - weight * a[x]));
    has_left = has_left || side > 0;
    has_right = has_right || side < 0;
  }
  return !(has_left && has_right);
}

// Whether the segment from p to q meets a triangle.
template <class T>
bool meets(const Vec3<T>& p, const Vec3<T>& q, const Triangle<T>& triangle) {
  const auto& c = triangle.corner;
  const Vec3<T> normal = cross(c[1] - c[0], c[2] - c[0]);
  if (!is_zero(normal)) {
    const T above_p = dot(normal, p - c[0]), above_q = dot(normal, q - c[0]);
    if (sign_of(above_p) * sign_of(above_q) > 0) return false;
    const T weight_p = magnitude(above_q), weight_q = magnitude(above_p), weight = weight_p + weight_q;
    if (weight > T(0)) return in_triangle(weight_p * p + weight_q * q, weight, triangle, normal);
    if (in_triangle(p, T(1), triangle, normal)) return true;
  }
  return segments_meet(p, q, c[0], c[1]) || segments_meet(p, q, c[1], c[2]) || segments_meet(p, q, c[2], c[0]);
}

// Whether two triangles meet: then an edge of one meets the other.
template <class T>
bool meet(const Triangle<T>& a, const Triangle<T>& b) {
  for (std::size_t k = 0; k < 3; ++k)
    if (meets(a.corner[k], a.corner[(k + 1) % 3], b) || meets(b.corner[k], b.corner[(k + 1) % 3], a)) return true;
  return false;
}

inline Real length(const Point& v) { return std::sqrt(dot(v, v)); }

inline Real distance_to_segment(const Point& p, const Point& a, const Point& b) {
  const Point d = b - a;
  const Real length_sq = dot(d, d);
  const Real t = length_sq > 0 ? std::clamp<Real>(dot(p - a, d) / length_sq, 0, 1) : 0;
  return length(p - (a + t * d));
}

// Of points inside both segments, or an end and the other. Never less than the distance, whatever rounding does to t.
inline Real distance_of_segments(const Point& p, const Point& q, const Point& r, const Point& s) {
  Real least = std::min({distance_to_segment(p, r, s), distance_to_segment(q, r, s), distance_to_segment(r, p, q),
                         distance_to_segment(s, p, q)});
  const Point d = q - p, e = s - r, between = r - p, across = cross(d, e);
  const Real all = dot(across, across);
  if (all == 0) return least;
  const Real t = std::clamp<Real>(dot(cross(between, e), across) / all, 0, 1);
  return std::min(least, distance_to_segment(p + t * d, r, s));
}

// How far a corner of one triangle is from its foot in another; infinite if that is outside. Never less than the
// distance.
inline Real distance_to_inside(const Point& p, const Triangle<Real>& triangle) {
  const auto& c = triangle.corner;
  const Point normal = cross(c[1] - c[0], c[2] - c[0]);
  Point foot{};
  Real all = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const Real weight = dot(cross(normal, c[(k + 2) % 3] - c[(k + 1) % 3]), p - c[(k + 1) % 3]);
    if (!(weight >= 0)) return HUGE_VALL;
    foot = foot + weight * (c[k] - c[0]);
    all += weight;
  }
  return all > 0 ? length(p - (c[0] + (1 / all) * foot)) : HUGE_VALL;
}

// Of triangles that do not meet.
inline Real distance_apart(const Triangle<Real>& a, const Triangle<Real>& b) {
  Real least = HUGE_VALL;
  for (std::size_t i = 0; i < 3; ++i) {
    least = std::min({least, distance_to_inside(a.corner[i], b), distance_to_inside(b.corner[i], a)});
    for (std::size_t j = 0; j < 3; ++j)
      least =
          std::min(least, distance_of_segments(a.corner[i], a.corner[(i + 1) % 3], b.corner[j], b.corner[(j + 1) % 3]));
  }
  return least;
}

inline Real distance(const Triangle<Real>& a, const Triangle<Real>& b) { return meet(a, b) ? 0 : distance_apart(a, b); }

// From a box about the origin, with sides across the axes.
inline Real distance_to_box(const Triangle<Real>& triangle, const Point& half) {
  Point corner[8];
  for (std::size_t i = 0; i < 8; ++i)
    for (std::size_t c = 0; c < 3; ++c) corner[i][c] = i >> c & 1 ? half[c] : -half[c];
  bool inside = true;
  for (std::size_t c = 0; c < 3; ++c) inside = inside && std::fabs(triangle.corner[0][c]) <= half[c];
  if (inside) return 0;
  Real out = HUGE_VALL;
  static constexpr std::size_t kSides[6][4] = {{0, 1, 3, 2}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                               {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 3, 7, 5}};
  for (const auto& side : kSides)
    for (const std::size_t third : {std::size_t{1}, std::size_t{3}})
      out = std::min(out, distance(triangle, {{corner[side[0]], corner[side[2]], corner[side[third]]}}));
  return out;
}

}  // namespace cab::oracle
