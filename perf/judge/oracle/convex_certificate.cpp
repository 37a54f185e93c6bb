// The search is GJK with all subsets of the simplex tried. No proof rests on how it found a plane or points: each is
// checked by itself, against bounds of the rounding that follow. q = 2^-53, all norms are Euclidean.
//
// A shape is col p + t with p in its own frame. Columns and t are rounded from long double: q per number. R is how far
// the shape reaches from its origin.
//
// Heights, for a plane. The local direction l_k = col_k . d errs by 4 q |d|: 1 for the column, 3 for the dot product. A
// support function has the Lipschitz constant R, so that moves a height by sqrt 3 x 4 q R |d| = 7 q R |d|. Its own
// evaluation costs sqrt 3 x 3 q R |d| at most (a box; the others have fewer sums per length): 5.2 q. t . d costs 4 q
// |t||d|, the sums 2 q N |d|. Both shapes: (12.2 + 2) q N |d| < 15 q N |d|. A height of a ball, r |d|, is inside that.
//
// Points, for touching. The local point is exact for boxes, segments and hulls; on an ellipsoid or a disc it is within
// 6 q R of a point of the shape. Posing costs sqrt 3 q R for the columns and 3 sqrt 3 q R for products and sums: 6.9 q.
// The difference with t is three roundings of N. Both shapes: (12.9 + 3) q N < 16 q N. A convex combination of such
// points, whose weights are not negative and at most 1 together, costs another 10 q N.
//
// The code allows 64 q N for each: kCertificateRounding.
#include "perf/judge/oracle/convex_certificate.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace cab::oracle {
namespace {

using Double3 = Vec3<double>;

// The most support points of one search.
constexpr int kMostPoints = 64;

// The distance counts as found when its bounds are this close, in parts of the size.
constexpr double kFound = 1e-13;

// How far a shape reaches from its origin, or a little more.
Real reach_of(const JudgeShape& shape) {
  const auto length = [](const Point& p) { return std::sqrt(dot(p, p)); };
  Real most = 0;
  switch (shape.kind) {
    case JudgeKind::kBox:
    case JudgeKind::kEllipsoid: return length(to_vec3(shape.size));
    case JudgeKind::kSphere: return shape.size[0];
    case JudgeKind::kCapsule:
    case JudgeKind::kCylinder: return shape.size[0] + shape.size[1];
    case JudgeKind::kHull:
      for (const Point& v : shape.vertices) most = std::max(most, length(v));
      return most;
    case JudgeKind::kHalfSpace: break;
  }
  return 0;
}

// A shape in double, its origin relative to that of a. Lengths are scaled.
struct Solid {
  JudgeKind kind = JudgeKind::kBox;
  Double3 column[3], at, size;
  std::vector<Double3> vertices;
  double radius = 0;  // of a ball that is added to the rest
  double reach = 0;

  Solid(const JudgeShape& shape, const Point& origin, Real scale) : kind(shape.kind) {
    for (std::size_t k = 0; k < 3; ++k) {
      column[k] = convert<double>(to_vec3(shape.pose.column[k]));
      size[k] = static_cast<double>(scale * shape.size[k]);
    }
    at = convert<double>(scale * (shape.pose.at - origin));
    vertices.reserve(shape.vertices.size());
    for (const Point& v : shape.vertices) vertices.push_back(convert<double>(scale * v));
    reach = static_cast<double>(scale * reach_of(shape));
    if (kind == JudgeKind::kSphere || kind == JudgeKind::kCapsule) radius = size[0];
  }
};

// The farthest point along a direction, without the ball, and its height with the ball.
struct Farthest {
  Double3 point;
  double height;
};

Farthest farthest(const Solid& solid, const Double3& d) {
  const Double3 l = {{dot(solid.column[0], d), dot(solid.column[1], d), dot(solid.column[2], d)}};
  const Double3& s = solid.size;
  Double3 p{};
  double height = 0;
  switch (solid.kind) {
    case JudgeKind::kBox:
      for (std::size_t k = 0; k < 3; ++k) {
        p[k] = l[k] < 0 ? -s[k] : s[k];
        height += s[k] * std::fabs(l[k]);
      }
      break;
    case JudgeKind::kEllipsoid: {
      const Double3 in_ball = {{s[0] * l[0], s[1] * l[1], s[2] * l[2]}};
      height = norm(in_ball);
      if (height > 0) p = {{s[0] * (in_ball[0] / height), s[1] * (in_ball[1] / height), s[2] * (in_ball[2] / height)}};
      break;
    }
    case JudgeKind::kCapsule:
    case JudgeKind::kCylinder: {
      p[2] = l[2] < 0 ? -s[1] : s[1];
      height = s[1] * std::fabs(l[2]);
      const double across = std::hypot(l[0], l[1]);
      if (solid.kind == JudgeKind::kCylinder && across > 0) {
        p[0] = s[0] * (l[0] / across);
        p[1] = s[0] * (l[1] / across);
        height += s[0] * across;
      }
      break;
    }
    case JudgeKind::kHull: {
      const Double3* best = &solid.vertices.front();
      height = dot(*best, l);
      for (const Double3& v : solid.vertices) {
        const double h = dot(v, l);
        if (h > height) {
          height = h;
          best = &v;
        }
      }
      p = *best;
      break;
    }
    case JudgeKind::kSphere:
    case JudgeKind::kHalfSpace: break;
  }
  height += dot(solid.at, d) + solid.radius * norm(d);
  return {solid.at + (p[0] * solid.column[0] + p[1] * solid.column[1] + p[2] * solid.column[2]), height};
}

// Whether the tetrahedron of four points holds all points within `within` of the origin. Proof: the origin lies that
// far on the inner side of each face. A product of three vectors errs by 8 q of their lengths for the cross product of
// two edges, and by 3 q for the dot product; 16 q are allowed for.
bool holds_ball(const std::array<Double3, 4>& x, double within) {
  constexpr double kProduct = 0x1p-49;
  for (std::size_t apex = 0; apex < 4; ++apex) {
    const Double3 &p = x[(apex + 1) % 4], &q = x[(apex + 2) % 4], &r = x[(apex + 3) % 4];
    const Double3 u = q - p, v = r - p, up = x[apex] - p;
    Double3 normal = cross(u, v);
    const double area = norm(u) * norm(v);
    double volume = dot(normal, up), height = dot(normal, p);
    if (!(std::fabs(volume) > kProduct * area * norm(up))) return false;
    if (volume > 0) height = -height;
    if (!(height > within * (norm(normal) + kProduct * area) + kProduct * area * norm(p))) return false;
  }
  return true;
}

// The point of the hull of some points that is nearest to the origin.
struct Nearest {
  double length_sq = 0;
  Double3 at{}, direction{};  // direction: that of `at`, by a formula that keeps it accurate where `at` is short
  std::array<Double3, 3> corner{};
  std::size_t count = 0;
};

void offer(const Double3& at, const Double3& direction, std::initializer_list<Double3> corners, Nearest& best) {
  const double length_sq = dot(at, at);
  if (best.count > 0 && !(length_sq < best.length_sq)) return;
  best.length_sq = length_sq;
  best.at = at;
  best.direction = direction;
  best.count = corners.size();
  std::copy(corners.begin(), corners.end(), best.corner.begin());
}

// What is left of v across e. v is across e but for rounding, which is large next to a short v.
Double3 across(const Double3& v, const Double3& e) { return v - (dot(v, e) / dot(e, e)) * e; }

// Of the corners of `old` with a new point p: among the points, edges and triangles with p.
Nearest nearest_with(const Nearest& old, const Double3& p) {
  Nearest best;
  offer(p, p, {p}, best);
  for (std::size_t i = 0; i < old.count; ++i) {
    const Double3& c = old.corner[i];
    const Double3 e = c - p;
    const double along = -dot(p, e) / dot(e, e);
    if (!(along > 0 && along < 1)) continue;
    const Double3 at = p + along * e;
    offer(at, across(at, e), {p, c}, best);
  }
  for (std::size_t i = 0; i < old.count; ++i) {
    for (std::size_t j = i + 1; j < old.count; ++j) {
      const Double3 e = old.corner[i] - p, f = old.corner[j] - p, n = cross(e, f);
      const double area_sq = dot(n, n), w_e = dot(cross(f, p), n) / area_sq, w_f = dot(cross(p, e), n) / area_sq;
      if (!(w_e > 0 && w_f > 0 && w_e + w_f < 1)) continue;
      const double side = dot(n, p);
      offer(p + (w_e * e + w_f * f), across(side < 0 ? -1.0 * n : n, e), {p, old.corner[i], old.corner[j]}, best);
    }
  }
  return best;
}

}  // namespace

Certificate certify(const JudgeShape& a, const JudgeShape& b, Effort effort) {
  Certificate out;
  if (a.kind == JudgeKind::kHalfSpace || b.kind == JudgeKind::kHalfSpace) return out;
  const Point between = b.pose.at - a.pose.at;
  int exponent = 0;
  std::frexp(reach_of(a) + reach_of(b) + norm_1(between), &exponent);
  const Real scale = std::ldexp(Real{1}, -exponent);
  const Solid of_a(a, a.pose.at, scale), of_b(b, a.pose.at, scale);
  const double size = of_a.reach + of_b.reach + norm(of_b.at), rounding = kCertificateRounding * size;
  const double radius = of_a.radius + of_b.radius;
  double widest = -2;  // gap found; sizes are below 1
  Nearest nearest;
  Double3 direction = -1.0 * of_b.at;  // of the difference a - b, away from the origin
  if (!(norm(direction) > 0)) direction = {{1, 0, 0}};
  for (int step = 0; step < kMostPoints; ++step) {
    const Double3 d = (1 / norm(direction)) * direction;
    const Farthest on_a = farthest(of_a, -1.0 * d), on_b = farthest(of_b, d);
    const Double3 p = on_a.point - on_b.point;
    // Along -d, a ends at on_a.height; along d, b ends at on_b.height. In between is the gap.
    const double gap = -(on_a.height + on_b.height);
    if (gap > widest) {
      widest = gap;
      out.normal = -1.0 * d;
    }
    if (effort == Effort::kDecide && widest > rounding) break;
    const double length = std::sqrt(nearest.length_sq);
    if (nearest.count > 0 && length - radius - widest <= kFound * size) break;
    if (nearest.count == 3) {
      const std::array<Double3, 4> tetrahedron = {nearest.corner[0], nearest.corner[1], nearest.corner[2], p};
      if (holds_ball(tetrahedron, rounding)) {
        out.proof = Proof::kTouching;
        return out;
      }
    }
    nearest = nearest_with(nearest, p);
    if (std::sqrt(nearest.length_sq) + rounding < radius) {
      out.proof = Proof::kTouching;
      if (effort == Effort::kDecide || widest <= rounding) return out;
    }
    if (!(dot(nearest.direction, nearest.direction) > 0)) break;
    direction = nearest.direction;
  }
  if (!(widest > rounding)) return out;
  out.proof = Proof::kApart;
  out.gap = std::ldexp(widest, exponent);
  return out;
}

Truth truth_of(const JudgeShape& a, const JudgeShape& b) {
  const Proof proof = certify(a, b, Effort::kDecide).proof;
  if (proof != Proof::kNone) return proof == Proof::kApart ? Truth::kApart : Truth::kTouching;
  const Verdict verdict = judge(a, b, Effort::kDecide);
  if (are_apart(verdict)) return Truth::kApart;
  return verdict.gap_at_most < 0 ? Truth::kTouching : Truth::kTooClose;
}

}  // namespace cab::oracle
