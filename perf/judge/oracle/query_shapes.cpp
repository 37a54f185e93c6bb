// Single convex bodies as queries meet them. Nearest points of boxes come from Gauss-Seidel steps, of ellipsoids from
// Newton's method, of hulls from GJK. A moved ball's first contact is the root of a convex function, its distance.
#include "perf/judge/oracle/query_shapes.h"

#include <algorithm>
#include <limits>

namespace cab::oracle {
namespace {

constexpr Real kInfinity = std::numeric_limits<Real>::infinity();

// Steps of Gauss and Seidel for a box: each leaves some 1e-5 of the error, for axes that are orthonormal to 1e-5.
constexpr int kBoxSteps = 6;

// Rounding of a distance, in parts of the coordinates and lengths that it comes from.
constexpr Real kRounding = 0x1p-58L;

// More rounds than any case took that was tried; a tangent halves the rest per round.
constexpr int kMostRounds = 400;

// Halvings of an interval, to the last bit of a Real.
constexpr int kHalvings = 80;

// A direction in a body's own frame, and a point.
Point along_axes(const QueryBody& body, const Point& d) {
  return {{dot(to_vec3(body.column[0]), d), dot(to_vec3(body.column[1]), d), dot(to_vec3(body.column[2]), d)}};
}
Point local(const QueryBody& body, const Point& p) { return along_axes(body, p - body.at); }

Point from_local(const QueryBody& body, const Point& p) { return body.at + rotated(body.column, p); }

Point nearest_of_box(const ExactBox& box, const Point& to) {
  Real x[3] = {};
  Point rest = to - center_of(box);  // less the point so far
  for (int step = 0; step < kBoxSteps; ++step)
    for (std::size_t k = 0; k < 3; ++k) {
      const Point axis = axis_of(box, k);
      const Real next = std::clamp(x[k] + dot(rest, axis) / dot(axis, axis), -box.half[k], box.half[k]);
      rest = rest - (next - x[k]) * axis;
      x[k] = next;
    }
  Point out = center_of(box);
  for (std::size_t k = 0; k < 3; ++k) out = out + x[k] * axis_of(box, k);
  return out;
}

// s with |(r_k y_k / (r_k^2 + s))| = 1 gives the nearest point r_k^2 y_k / (r_k^2 + s). 1 / that length is concave in
// s, so Newton's method stays below the root.
Point nearest_of_ellipsoid(const Real (&r)[3], const Point& y) {
  const auto scaled = [&](Real s) {
    return Point{{r[0] * y[0] / (r[0] * r[0] + s), r[1] * y[1] / (r[1] * r[1] + s), r[2] * y[2] / (r[2] * r[2] + s)}};
  };
  if (dot(scaled(0), scaled(0)) <= 1) return y;
  Real s = 0;
  for (int round = 0; round < kMostRounds; ++round) {
    const Point w = scaled(s);
    Real slope = 0;  // of half the square of |w|, turned round
    for (std::size_t k = 0; k < 3; ++k) slope += w[k] * w[k] / (r[k] * r[k] + s);
    const Real size = length_of(w), step = (size - 1) * size * size / slope;
    const Real next = s + step;
    if (!(next > s) || step <= std::numeric_limits<Real>::epsilon() * next) break;
    s = next;
  }
  Point out = scaled(s);
  for (std::size_t k = 0; k < 3; ++k) out[k] *= r[k];
  return out;
}

// What a distance from a body to a point may be off by rounding.
Real rounding_at(const QueryBody& body, const Point& p) {
  const Real reach = body.reach < kInfinity ? body.reach : 0;
  return kRounding * (norm_1(p) + norm_1(body.middle) + reach);
}

// The point of least length of a hull of up to four points, and which of them it needs.
struct Least {
  Point point;
  Real square = kInfinity;
  unsigned needed = 0;
};

Real det(const Point& a, const Point& b, const Point& c) { return dot(a, cross(b, c)); }

// Looks at the points of one subset alone: the point of their affine hull that is nearest to 0, if it is in their hull.
void try_subset(const Point (&p)[4], unsigned subset, Least& best) {
  Point q[4];
  unsigned count = 0;
  for (unsigned i = 0; i < 4; ++i)
    if (subset >> i & 1) q[count++] = p[i];
  Point at = q[0];
  if (count == 2) {
    const Point u = q[1] - q[0];
    const Real s = -dot(q[0], u) / dot(u, u);
    if (!(s > 0 && s < 1)) return;
    at = q[0] + s * u;
  } else if (count == 3) {
    const Point u = q[1] - q[0], v = q[2] - q[0], n = cross(u, v);
    const Real size = dot(n, n);
    if (!(size > 0)) return;
    const Real s = dot(cross(v, q[0]), n) / size, t = dot(cross(q[0], u), n) / size;
    if (!(s > 0 && t > 0 && s + t < 1)) return;
    at = dot(q[0], n) / size * n;
  } else if (count == 4) {
    const Real whole = det(q[1] - q[0], q[2] - q[0], q[3] - q[0]);
    const Real shares[4] = {det(q[1], q[2], q[3]), -det(q[0], q[2], q[3]), det(q[0], q[1], q[3]),
                            -det(q[0], q[1], q[2])};
    for (const Real share : shares)
      if (!(share * whole > 0)) return;
    at = {};
  }
  const Real square = dot(at, at);
  if (square < best.square) best = {at, square, subset};
}

// The nearest point of a hull to 0, by GJK.
Point nearest_of_hull(const std::vector<Point>& vertices, const Point& to) {
  Point p[4];
  std::size_t index[4];
  std::size_t first = 0;
  Real size = 0;
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    if (length_of(vertices[i] - to) < length_of(vertices[first] - to)) first = i;
    size = larger(size, length_of(vertices[i] - to));
  }
  p[0] = vertices[first] - to;
  index[0] = first;
  unsigned held = 1;  // bits of p
  Least best{p[0], dot(p[0], p[0]), 1};
  for (int round = 0; round < kMostRounds; ++round) {
    if (best.needed == 15 || best.square <= kRounding * kRounding * size * size) return to;
    std::size_t lowest = 0;
    Real least = kInfinity;
    for (std::size_t i = 0; i < vertices.size(); ++i)
      if (const Real along = dot(vertices[i] - to, best.point); along < least) {
        least = along;
        lowest = i;
      }
    if (best.square - least <= kRounding * std::sqrt(best.square) * std::sqrt(best.square)) break;
    bool known = false;
    unsigned free = 0;
    for (unsigned i = 0; i < 4; ++i) {
      if (held >> i & 1)
        known = known || index[i] == lowest;
      else
        free = i;
    }
    if (known) break;
    p[free] = vertices[lowest] - to;
    index[free] = lowest;
    held |= 1u << free;
    const Real before = best.square;
    best = {};
    for (unsigned subset = 1; subset < 16; ++subset)
      if ((subset & held) == subset) try_subset(p, subset, best);
    held = best.needed;
    if (!(best.square < before)) break;
  }
  return to + best.point;
}

// The interval of a line within a parallelepiped, by slabs between its faces.
std::optional<Real> enter_box(const ExactBox& box, const Point& at, const Point& direction, Real most) {
  Real begin = 0, end = most;
  for (std::size_t k = 0; k < 3; ++k) {
    const Point normal = cross(axis_of(box, (k + 1) % 3), axis_of(box, (k + 2) % 3));
    const Real from = dot(normal, at - center_of(box)), speed = dot(normal, direction);
    const Real half = box.half[k] * std::fabs(dot(normal, axis_of(box, k)));
    if (speed == 0) {
      if (std::fabs(from) > half) return std::nullopt;
      continue;
    }
    const Real t = (-half - from) / speed, u = (half - from) / speed;
    begin = larger(begin, std::fmin(t, u));
    end = std::fmin(end, std::fmax(t, u));
  }
  if (begin > end) return std::nullopt;
  return begin;
}

}  // namespace

void complete(QueryBody& body) {
  const Real* const s = body.size;
  body.middle = body.at;
  switch (body.kind) {
    case JudgeKind::kBox: {
      body.middle = center_of(body.box);
      for (unsigned i = 0; i < 8; ++i) body.reach = larger(body.reach, length_of(corner(body.box, i) - body.middle));
      break;
    }
    case JudgeKind::kSphere: body.reach = s[0]; break;
    case JudgeKind::kEllipsoid: {
      const Real most = larger(larger(s[0], s[1]), s[2]), least = std::fmin(std::fmin(s[0], s[1]), s[2]);
      body.reach = most;
      body.bluntness = least * least / most;
      break;
    }
    case JudgeKind::kCapsule: body.reach = s[0] + s[1]; break;
    case JudgeKind::kCylinder: body.reach = std::sqrt(s[0] * s[0] + s[1] * s[1]); break;
    case JudgeKind::kHull:
      for (const Point& v : body.vertices) body.reach = larger(body.reach, length_of(v));
      break;
    case JudgeKind::kHalfSpace: body.reach = kInfinity; break;
  }
}

JudgeShape shape_of(const QueryBody& body, const Point& shift) {
  JudgeShape out;
  out.kind = body.kind;
  if (body.kind == JudgeKind::kBox) {
    for (std::size_t k = 0; k < 3; ++k) out.size[k] = body.box.half[k];
    for (std::size_t k = 0; k < 3; ++k) store(axis_of(body.box, k), out.pose.column[k]);
    out.pose.at = center_of(body.box) + shift;
    return out;
  }
  out.pose.at = body.at + shift;
  out.vertices = body.vertices;
  if (body.kind == JudgeKind::kHull) return out;
  for (std::size_t k = 0; k < 3; ++k) out.size[k] = body.size[k];
  for (std::size_t k = 0; k < 3; ++k) store(to_vec3(body.column[k]), out.pose.column[k]);
  return out;
}

QueryBody grown(QueryBody body, Real by) {
  if (body.kind != JudgeKind::kBox) return body;
  for (Real& half : body.box.half) half += by;
  body.reach += 2 * by;
  return body;
}

Point nearest_point(const QueryBody& body, const Point& to) {
  const Real* const s = body.size;
  switch (body.kind) {
    case JudgeKind::kBox: return nearest_of_box(body.box, to);
    case JudgeKind::kHull: return body.at + nearest_of_hull(body.vertices, to - body.at);
    case JudgeKind::kHalfSpace: {
      const Point up = to_vec3(body.column[2]);
      return to - larger(Real{0}, dot(up, to - body.at)) * up;
    }
    case JudgeKind::kSphere: {
      const Point from = to - body.at;
      return length_of(from) <= s[0] ? to : body.at + s[0] / length_of(from) * from;
    }
    case JudgeKind::kEllipsoid: return from_local(body, nearest_of_ellipsoid(body.size, local(body, to)));
    case JudgeKind::kCapsule: {
      const Point y = local(body, to);
      const Point core = {{0, 0, std::clamp(y[2], -s[1], s[1])}}, from = y - core;
      return length_of(from) <= s[0] ? to : from_local(body, core + s[0] / length_of(from) * from);
    }
    case JudgeKind::kCylinder: {
      Point y = local(body, to);
      const Real across = std::hypot(y[0], y[1]), shrink = across > s[0] ? s[0] / across : 1;
      y = {{shrink * y[0], shrink * y[1], std::clamp(y[2], -s[1], s[1])}};
      return from_local(body, y);
    }
  }
  return to;
}

Real support_of(const QueryBody& body, const Point& direction) {
  const Real* const s = body.size;
  if (body.kind == JudgeKind::kBox) {
    Real out = dot(center_of(body.box), direction);
    for (std::size_t k = 0; k < 3; ++k) out += body.box.half[k] * std::fabs(dot(axis_of(body.box, k), direction));
    return out;
  }
  const Real at = dot(body.at, direction);
  if (body.kind == JudgeKind::kHull) {
    Real most = -kInfinity;
    for (const Point& v : body.vertices) most = larger(most, dot(v, direction));
    return at + most;
  }
  const Point d = along_axes(body, direction);
  switch (body.kind) {
    case JudgeKind::kSphere: return at + s[0] * length_of(d);
    case JudgeKind::kEllipsoid: return at + length_of({{s[0] * d[0], s[1] * d[1], s[2] * d[2]}});
    case JudgeKind::kCapsule: return at + s[0] * length_of(d) + s[1] * std::fabs(d[2]);
    case JudgeKind::kCylinder: return at + s[0] * std::hypot(d[0], d[1]) + s[1] * std::fabs(d[2]);
    default: return std::hypot(d[0], d[1]) <= 1e-5L * d[2] ? at : kInfinity;  // a half space
  }
}

Real distance_of_point(const QueryBody& body, const Point& to) {
  const Real distance = length_of(to - nearest_point(body, to));
  return distance <= rounding_at(body, to) ? 0 : distance;
}

std::optional<Real> first_contact(const QueryBody& body, const Point& at, const Point& direction, Real most,
                                  Real radius) {
  if (radius < 0 || (body.kind == JudgeKind::kHull && body.vertices.empty())) return std::nullopt;
  if (body.kind == JudgeKind::kBox && radius == 0) {
    for (const Real half : body.box.half)
      if (half < 0) return std::nullopt;
    return enter_box(body.box, at, direction, most);
  }
  // The distance is convex along the line, so Newton's method from the left never passes the first root.
  Real t = 0;
  for (int round = 0; round < kMostRounds; ++round) {
    const Point here = at + t * direction, away = here - nearest_point(body, here);
    const Real distance = length_of(away);
    if (distance <= radius + rounding_at(body, here) + kRounding * radius) return t;
    const Real slope = dot(away, direction) / distance;
    if (!(slope < 0)) return std::nullopt;
    t += (distance - radius) / -slope;
    if (!(t <= most)) return std::nullopt;
  }
  return t;
}

Real distance_of_segment(const QueryBody& body, const Point& at, const Point& along) {
  Real least = kInfinity;
  // The slope of the distance at one point; 0 where it is 0.
  const auto slope_at = [&](Real s) -> Real {
    const Point here = at + s * along, away = here - nearest_point(body, here);
    const Real distance = length_of(away) <= rounding_at(body, here) ? 0 : length_of(away);
    least = std::fmin(least, distance);
    return distance == 0 ? 0 : dot(away, along);
  };
  Real low = -1, high = 1;
  if (slope_at(low) >= 0 || slope_at(high) <= 0 || least == 0) return least;
  for (int halving = 0; halving < kHalvings; ++halving) {
    const Real middle = (low + high) / 2, slope = slope_at(middle);
    if (slope == 0) break;
    (slope < 0 ? low : high) = middle;
  }
  return least;
}

QueryBody clipped(const ExactBox& box, const QueryBody& half_space) {
  const Point up = to_vec3(half_space.column[2]);
  QueryBody out;
  out.kind = JudgeKind::kHull;
  out.at = center_of(box);
  Point corners[8];
  Real heights[8];
  for (unsigned i = 0; i < 8; ++i) {
    corners[i] = corner(box, i) - out.at;
    heights[i] = dot(up, out.at - half_space.at) + dot(up, corners[i]);
    if (heights[i] <= 0) out.vertices.push_back(corners[i]);
  }
  for (unsigned i = 0; i < 8; ++i)
    for (unsigned k = 0; k < 3; ++k) {
      const unsigned j = i | 1u << k;
      if (j == i || (heights[i] <= 0) == (heights[j] <= 0)) continue;
      const Real share = heights[i] / (heights[i] - heights[j]);
      out.vertices.push_back(corners[i] + share * (corners[j] - corners[i]));
    }
  complete(out);
  return out;
}

}  // namespace cab::oracle
