// Rays and moved spheres against exact shapes and boxes, judged in long double: distances by trying every face, edge
// and corner, minima along the ray by bisection.
#include "engine/queries/ray_cast.h"

#include "kernels/float_mode.h"
#include "layout/convex_shapes.h"
#include "layout/error_bounds.h"
#include "perf/judge/oracle/convex_faces.h"
#include "perf/judge/oracle/exact_pose.h"
#include "perf/judge/oracle/random.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <vector>

namespace {

using namespace cab;
using namespace cab::tests;
using oracle::ExactPose;
using oracle::Point;
using oracle::Random;
using oracle::Real;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr Real kJudgeRounding = 0x1p-61L;  // of a distance, as a share of the lengths that it is made of

// How far the point of a touch may be from the surface, in slacks. Most measured: 6.3.
constexpr Real kPointOff = 12;

// How far from square to the ray a normal may be on the wrong side, by rounding. Most measured: 1.5e-17.
constexpr Real kTurned = 0x1p-52L;

// How far from a hull a sphere may be where the search for the parameter gives up, as a share of the square of the
// hull's reach over the radius. Most measured: 2^-52, in 2 of 240 000 rays, of needles and plates.
constexpr Real kHullGaveUp = 0x1p-50L;

// How far the length of a normal may be from 1. Most measured: 9.8e-16.
constexpr Real kNormalOff = 0x1p-48L;

Real norm(const Point& v) { return std::sqrt(dot(v, v)); }
Point point(const Double3& v) { return {{v.x, v.y, v.z}}; }
Double3 double3(const Point& v) {
  return {static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])};
}

// The part of the segment from p to q that is nearest to x.
Point nearest_on(const Point& p, const Point& q, const Point& x) {
  const Point edge = q - p;
  const Real square = dot(edge, edge);
  const Real at = square > 0 ? std::clamp<Real>(dot(x - p, edge) / square, 0, 1) : 0;
  return p + at * edge;
}

// A shape in the world's axes, relative to its centre, in long double.
struct Truth {
  ConvexKind kind;
  Point center;
  Point axis[3];
  Real size[3];
  Real ball = 0;  // around a round shape's segment
  std::vector<Point> vertices;
  std::vector<Point> normals;  // of a hull that is not flat

  Real reach() const {
    Real most = ball + size[0] + size[1] + size[2];
    for (const Point& v : vertices) most = std::max(most, norm(v));
    return most;
  }

  Point in_axes(const Point& x) const {  // the weights of the axes, which may be skew
    const Point n[3] = {cross(axis[1], axis[2]), cross(axis[2], axis[0]), cross(axis[0], axis[1])};
    const Real volume = dot(axis[0], n[0]);
    return {{dot(x, n[0]) / volume, dot(x, n[1]) / volume, dot(x, n[2]) / volume}};
  }
  Point of_axes(const Point& y) const { return y[0] * axis[0] + y[1] * axis[1] + y[2] * axis[2]; }

  // A point of the core, relative to the centre, farthest along a direction.
  Point farthest(const Point& d) const {
    const Real along[3] = {dot(axis[0], d), dot(axis[1], d), dot(axis[2], d)};
    const auto sign = [](Real v) -> Real { return v < 0 ? -1 : 1; };
    if (kind == ConvexKind::kHull)
      return *std::max_element(vertices.begin(), vertices.end(),
                               [&](const Point& a, const Point& b) { return dot(a, d) < dot(b, d); });
    if (kind == ConvexKind::kRound) return sign(along[2]) * size[2] * axis[2];
    if (kind == ConvexKind::kBox)
      return of_axes({{sign(along[0]) * size[0], sign(along[1]) * size[1], sign(along[2]) * size[2]}});
    if (kind == ConvexKind::kHalfSpace) return {};
    Point y{};
    if (kind == ConvexKind::kCylinder) {
      const Real across = std::hypot(along[0], along[1]);
      for (std::size_t c = 0; c < 2; ++c) y[c] = across > 0 ? size[0] * along[c] / across : 0;
      y[2] = sign(along[2]) * size[2];
    } else {
      const Real by = norm({{size[0] * along[0], size[1] * along[1], size[2] * along[2]}});
      for (std::size_t c = 0; c < 3; ++c) y[c] = size[c] * size[c] * along[c] / by;
    }
    return of_axes(y);
  }

  // The core's point closest to x, both relative to the centre.
  Point nearest(const Point& x) const {
    const Point y = in_axes(x);
    switch (kind) {
      case ConvexKind::kRound: return nearest_on(-size[2] * axis[2], size[2] * axis[2], x);
      case ConvexKind::kHalfSpace: return y[2] <= 0 ? x : x - dot(axis[2], x) * axis[2];
      case ConvexKind::kBox: return nearest_of_box(x, y);
      case ConvexKind::kHull: return nearest_of_hull(x);
      case ConvexKind::kCylinder: {
        const Real across = std::hypot(y[0], y[1]), by = across > size[0] ? size[0] / across : 1;
        return of_axes({{by * y[0], by * y[1], std::clamp(y[2], -size[2], size[2])}});
      }
      case ConvexKind::kEllipsoid: return of_axes(nearest_of_ellipsoid(y));
    }
    return {};
  }

 private:
  static void take_nearer(const Point& x, const Point& candidate, std::optional<Point>& best) {
    if (!best || norm(x - candidate) < norm(x - *best)) best = candidate;
  }

  Point nearest_of_box(const Point& x, const Point& y) const {
    if (std::fabs(y[0]) <= size[0] && std::fabs(y[1]) <= size[1] && std::fabs(y[2]) <= size[2]) return x;
    std::optional<Point> best;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t i = (k + 1) % 3, j = (k + 2) % 3;
      const Real ii = dot(axis[i], axis[i]), jj = dot(axis[j], axis[j]), ij = dot(axis[i], axis[j]);
      for (const Real at : {-size[k], size[k]}) {
        const Point base = at * axis[k], to = x - base;
        const Real a = dot(to, axis[i]), b = dot(to, axis[j]), det = ii * jj - ij * ij;
        const Real u = (a * jj - b * ij) / det, v = (b * ii - a * ij) / det;
        if (std::fabs(u) <= size[i] && std::fabs(v) <= size[j]) take_nearer(x, base + u * axis[i] + v * axis[j], best);
        for (const Real other : {-size[i], size[i]}) {  // the edges along j
          const Point middle = base + other * axis[i];
          take_nearer(x, nearest_on(middle - size[j] * axis[j], middle + size[j] * axis[j], x), best);
        }
      }
    }
    return *best;
  }

  Point nearest_of_hull(const Point& x) const {
    const auto is_below = [&](const Point& n) { return dot(n, x) <= dot(n, farthest(n)); };
    if (!normals.empty() && std::all_of(normals.begin(), normals.end(), is_below)) return x;
    std::optional<Point> best;
    for (std::size_t i = 0; i < vertices.size(); ++i)
      for (std::size_t j = 0; j < i; ++j) {
        take_nearer(x, nearest_on(vertices[i], vertices[j], x), best);
        for (std::size_t k = 0; k < j; ++k) {
          const Point e = vertices[j] - vertices[i], f = vertices[k] - vertices[i], to = x - vertices[i];
          const Point n = cross(e, f);
          const Real square = dot(n, n);
          if (!(square > 0)) continue;
          const Real u = dot(cross(to, f), n) / square, v = dot(cross(e, to), n) / square;
          if (u >= 0 && v >= 0 && u + v <= 1) take_nearer(x, vertices[i] + u * e + v * f, best);
        }
      }
    return *best;
  }

  Point nearest_of_ellipsoid(const Point& y) const {
    const auto beyond = [&](Real t) {
      Real sum = -1;
      for (std::size_t c = 0; c < 3; ++c) sum += std::pow(size[c] * y[c] / (t + size[c] * size[c]), 2);
      return sum;
    };
    if (beyond(0) <= 0) return y;
    Real lo = 0, hi = norm(y) * std::max({size[0], size[1], size[2]});
    for (int i = 0; i < 90; ++i) {
      const Real at = (lo + hi) / 2;
      (beyond(at) > 0 ? lo : hi) = at;
    }
    Point out;
    for (std::size_t c = 0; c < 3; ++c) out[c] = size[c] * size[c] * y[c] / (lo + size[c] * size[c]);
    return out;
  }
};

// A shape with all that it refers to.
struct Made {
  ConvexPart part;
  std::vector<float> vertices;
  oracle::Poses poses;
  Arena arena{default_allocator()};
  const ConvexShape* shape = nullptr;
  StoredPose stored;
  BoxAos box;  // instead of a shape, if `shape` is null
  Truth truth;

  bool cast(const LocalRay& ray, RayTouch* out) const {
    return shape ? cast_ray(ray, *shape, stored, out) : cast_ray(ray, box, out);
  }
  Real slack(const LocalRay& ray) const {
    return static_cast<Real>(shape ? ray_slack(ray, *shape, stored) : ray_slack(ray, box));
  }
};

constexpr ShapeKind kKinds[] = {ShapeKind::kBox,    ShapeKind::kEllipsoid, ShapeKind::kCapsule,  ShapeKind::kConvexHull,
                                ShapeKind::kSphere, ShapeKind::kCylinder,  ShapeKind::kHalfSpace};

enum class Regime { kRegular, kThin, kFlat, kTiny, kHuge, kFar };
constexpr Regime kRegimes[] = {Regime::kRegular, Regime::kThin, Regime::kFlat,
                               Regime::kTiny,    Regime::kHuge, Regime::kFar};

Real unit_of(Regime regime, Random& random) {
  return regime == Regime::kTiny   ? random.log_uniform(1e-20, 1e-12)
         : regime == Regime::kHuge ? random.log_uniform(1e9, 1e15)
                                   : random.log_uniform(0.05, 5);
}

void random_quaternion(Random& random, float* out) {
  double q[4], square = 0;
  do {
    square = 0;
    for (double& c : q) {
      c = random.normal();
      square += c * c;
    }
  } while (square < 1e-3);
  for (int c = 0; c < 4; ++c) out[c] = static_cast<float>(q[c] / std::sqrt(square));
  if (random.chance(0.2))
    for (int c = 0; c < 4; ++c) out[c] = c == 3;
}

// Poses of one link of one instance, in any format and scaling.
void make_pose(Random& random, double away, oracle::Poses& out) {
  out.instance_count = out.link_count = 1;
  out.format = static_cast<PoseFormat>(random.index(3));
  out.data.assign(out.floats_per_pose(), 0);
  float q[4];
  random_quaternion(random, q);
  float at[3];
  for (float& c : at) c = static_cast<float>(away * random.normal());
  if (out.format == PoseFormat::kQuaternionTranslation) {
    std::copy_n(q, 4, out.data.begin());
    std::copy_n(at, 3, out.data.begin() + 4);
  } else {
    const Real exact[4] = {q[0], q[1], q[2], q[3]};
    Real column[3][3];
    oracle::quaternion_matrix(exact, column);
    out.has_scale = random.chance(0.3);
    const Real scale = out.has_scale ? random.log_uniform(0.01, 100) : 1, hand = random.chance(0.5) ? -1 : 1;
    const bool rows = out.format == PoseFormat::kMatrix3x4Rows;
    for (std::size_t k = 0; k < 3; ++k)
      for (std::size_t c = 0; c < 3; ++c) {
        const Real skew = random.chance(0.3) ? random.uniform(-1e-4, 1e-4) : 0;
        out.data[rows ? 4 * c + k : 4 * k + c] =
            static_cast<float>(scale * ((k == 1 ? hand : 1) * column[k][c] + skew));
      }
    for (std::size_t c = 0; c < 3; ++c) out.data[rows ? 4 * c + 3 : 12 + c] = at[c];
  }
  if (!out.has_scale && random.chance(0.3)) out.scales = {static_cast<float>(random.log_uniform(0.01, 100))};
  if (random.chance(0.5)) {
    out.orientations.resize(4);
    random_quaternion(random, out.orientations.data());
  }
}

void make_vertices(Random& random, bool is_flat, const double (&size)[3], std::vector<float>& out) {
  const std::size_t count = is_flat ? 3 + random.index(3) : 4 + random.index(4);
  for (std::size_t v = 0; v < count; ++v)
    for (std::size_t c = 0; c < 3; ++c)
      out.push_back(is_flat && c == 2 ? 0 : static_cast<float>(size[c] * random.uniform(-1, 1)));
}

// A posed shape of a kind, or a posed box.
void make_shape(Random& random, Regime regime, ShapeKind kind, Made& out) {
  const double unit = static_cast<double>(unit_of(regime, random));
  double size[3];
  for (double& s : size) s = unit * random.log_uniform(0.3, 1);
  if (regime == Regime::kThin) {
    const double thin = random.log_uniform(1e-6, 1e-2);
    const std::uint32_t which = random.index(3);
    if (random.chance(0.5)) {
      size[which] *= thin;  // a plate
    } else {
      for (std::size_t c = 0; c < 3; ++c) size[c] *= c == which ? 1 : thin;  // a needle
    }
  }
  if (regime == Regime::kFlat && kind != ShapeKind::kEllipsoid)
    for (double& s : size) s *= random.chance(0.4) ? 0 : 1;
  const double away = regime == Regime::kFar ? unit * random.log_uniform(10, 1e5) : unit * random.uniform(0, 3);
  ConvexPart& part = out.part;
  part.kind = kind;
  random_quaternion(random, part.rotation);
  for (int c = 0; c < 3; ++c) part.position[c] = static_cast<float>(0.1 * away * random.normal());
  for (int c = 0; c < 3; ++c) part.size[c] = static_cast<float>(size[c]);
  if (kind == ShapeKind::kConvexHull) {
    if (regime != Regime::kFlat)
      make_vertices(random, false, size, out.vertices);
    else
      make_vertices(random, true, {unit, unit, unit}, out.vertices);
    part.vertices = out.vertices;
  }
  make_pose(random, away, out.poses);
  const oracle::Poses& poses = out.poses;
  const Scaling scaling = poses.has_scale         ? Scaling::kInMatrices
                          : !poses.scales.empty() ? Scaling::kPerInstance
                                                  : Scaling::kNone;
  out.stored = {{poses.format, scaling},
                poses.data.data(),
                poses.orientations.empty() ? nullptr : poses.orientations.data(),
                poses.scales.empty() ? 1 : poses.scales[0]};
  static constexpr std::uint32_t kBegin[] = {0, 1};
  Articulation articulation;
  articulation.leaf_count = 1;
  articulation.parts = {&part, 1};
  articulation.leaf_part_begin = {kBegin, 2};
  out.shape = &make_convex_shapes(articulation, out.arena).shapes[0];

  const ExactPose pose = oracle::exact_pose(poses, 0, 0);
  Truth& truth = out.truth;
  truth.kind = out.shape->kind;
  const auto posed = [&](const Point& v) { return rotated(pose.column, v); };
  truth.center = pose.at + posed(pose.scale * oracle::convert<Real>(oracle::to_vec3(part.position)));
  const Real q[4] = {part.rotation[0], part.rotation[1], part.rotation[2], part.rotation[3]};
  Real column[3][3];
  oracle::quaternion_matrix(q, column);
  for (std::size_t k = 0; k < 3; ++k) truth.axis[k] = posed(oracle::to_vec3(column[k]));
  for (std::size_t c = 0; c < 3; ++c) truth.size[c] = pose.scale * part.size[c];
  if (kind == ShapeKind::kCapsule || kind == ShapeKind::kSphere) {
    truth.ball = truth.size[0];
    truth.size[2] = kind == ShapeKind::kCapsule ? truth.size[1] : 0;
    truth.size[0] = truth.size[1] = 0;
  } else if (kind == ShapeKind::kCylinder) {
    truth.size[2] = truth.size[1];
    truth.size[1] = 0;
  } else if (kind == ShapeKind::kConvexHull || kind == ShapeKind::kHalfSpace) {
    truth.size[0] = truth.size[1] = truth.size[2] = 0;
  }
  for (std::size_t v = 0; v < out.vertices.size(); v += 3)
    truth.vertices.push_back(pose.scale * truth.of_axes({{out.vertices[v], out.vertices[v + 1], out.vertices[v + 2]}}));
  if (kind == ShapeKind::kConvexHull && regime != Regime::kFlat) {
    // In a frame of size 1, for find_faces.
    std::vector<Point> scaled;
    const Real by = 1 / truth.reach();
    for (const Point& v : truth.vertices) scaled.push_back(by * v);
    truth.normals = oracle::find_faces(scaled).normals;
  }
}

// A box as engines pose them: of floats, with axes that are orthonormal to a few roundings of a float.
void make_box(Random& random, Regime regime, Made& out) {
  make_shape(random, regime, ShapeKind::kBox, out);
  Truth& truth = out.truth;
  out.box = {};
  for (std::size_t k = 0; k < 3; ++k) {
    out.box.center[k] = static_cast<float>(truth.center[k]);
    out.box.half[k] = static_cast<float>(truth.size[k]);
    truth.center[k] = out.box.center[k];
    truth.size[k] = out.box.half[k];
    for (std::size_t c = 0; c < 3; ++c) {
      out.box.axis[3 * k + c] = static_cast<float>(truth.axis[k][c]);
      truth.axis[k][c] = out.box.axis[3 * k + c];
    }
  }
  out.shape = nullptr;
}

Point random_direction(Random& random, const Truth& truth) {
  if (random.chance(0.25)) return (random.chance(0.5) ? Real{1} : Real{-1}) * truth.axis[random.index(3)];
  Point out = oracle::convert<Real>(random.unit_vector());
  if (random.chance(0.1)) {
    out = out + static_cast<Real>(random.log_uniform(1e3, 1e18)) * truth.axis[random.index(3)];
  } else if (random.chance(0.1)) {
    out = {{0, 0, 1}};
  }
  return (1 / norm(out)) * out;
}

// A ray that is aimed at the shape, along its surface or past it.
LocalRay make_ray(Random& random, const Truth& truth) {
  LocalRay ray = {};
  const Real reach = std::max<Real>(truth.reach(), truth.kind == ConvexKind::kHalfSpace ? 1 : 1e-30L);
  if (random.chance(0.4)) ray.radius = static_cast<double>(reach) * random.log_uniform(1e-6, 10);
  Point d = random_direction(random, truth), through;
  if (random.chance(0.5)) {
    // Along a tangent, or nearly so.
    Point n = cross(d, random_direction(random, truth));
    if (!(norm(n) > 1e-3L)) n = cross(d, oracle::convert<Real>(random.unit_vector()));
    n = (1 / norm(n)) * n;
    const Real off = random.chance(0.1) ? 0 : random.sign() * random.log_uniform(1e-17, 1e-2);
    through = truth.farthest(n) + (truth.ball + static_cast<Real>(ray.radius) + off * reach) * n;
  } else {
    // At a point of the shape's, or beside it.
    const Point a = truth.farthest(oracle::convert<Real>(random.unit_vector()));
    const Point b = truth.farthest(oracle::convert<Real>(random.unit_vector()));
    const Real spread = random.chance(0.5) ? 0 : random.uniform(0, 2);
    through = static_cast<Real>(0.5) * (a + b) + spread * reach * oracle::convert<Real>(random.unit_vector());
  }
  ray.direction = double3(d);
  d = point(ray.direction);
  const Point line = truth.center + through;
  const Real away = random.chance(0.5) ? dot(line, d) : random.uniform(-3, 3) * reach;
  ray.at = double3(line - away * d);
  if (random.chance(0.2)) { ray.error = static_cast<double>(reach) * random.log_uniform(1e-16, 1e-3); }
  // The range begins before the shape, in it or behind it.
  const Real toward = dot(truth.center + through - point(ray.at), d);
  const double span = static_cast<double>(reach + static_cast<Real>(ray.radius));
  const double before = random.chance(0.2) ? random.log_uniform(1, 1e6) : random.uniform(-1, 4);
  ray.begin = static_cast<double>(toward) - span * before;
  ray.end = random.chance(0.5)   ? kInfinity
            : random.chance(0.1) ? ray.begin
                                 : ray.begin + span * (random.chance(0.5) ? random.uniform(0, 6) : 1e3);
  return ray;
}

// The least distance of the core from a ray's points with begin <= t <= end. Its slope along the ray is that of the
// direction from the closest point, and it is convex: bisection finds where the slope is 0.
Real least_distance(const Truth& truth, const Point& at, const Point& d, Real begin, Real end) {
  const Point from = at - truth.center;
  const auto off = [&](Real t) {
    const Point x = from + t * d;
    return x - truth.nearest(x);
  };
  if (truth.kind == ConvexKind::kEllipsoid) {
    // In the space in which the ellipsoid is a ball it is quicker to see that the ray meets it.
    Point y = truth.in_axes(from), e = truth.in_axes(d);
    for (std::size_t c = 0; c < 3; ++c) {
      y[c] /= truth.size[c];
      e[c] /= truth.size[c];
    }
    const Point x = y + std::clamp(-dot(y, e) / dot(e, e), begin, end) * e;
    if (dot(x, x) <= 1) return 0;
  }
  Real least = std::min(norm(off(begin)), norm(off(end)));
  for (int i = 0; i < 70 && least > 0 && begin < end; ++i) {
    const Real t = (begin + end) / 2;
    const Point v = off(t);
    least = std::min(least, norm(v));
    (dot(v, d) < 0 ? begin : end) = t;
  }
  return least;
}

struct Worst {
  std::uint64_t judged = 0, hits = 0, inside = 0, lost = 0, loose = 0, bad = 0, gave_up = 0;
  Real growth = 0;  // the largest distance where a touch is reported, in slacks
  Real point = 0;   // of the point from the shape, in slacks
  Real length = 0;  // of normals, from 1
};

std::uint64_t bits_of(double v) {
  std::uint64_t out;
  std::memcpy(&out, &v, sizeof out);
  return out;
}

void judge(Random& random, const Made& made, const LocalRay& ray, Worst& worst) {
  const Truth& truth = made.truth;
  RayTouch touch = {}, again = {};
  const bool does_touch = made.cast(ray, &touch), does_again = made.cast(ray, &again);
  worst.bad += does_touch != does_again || bits_of(touch.at) != bits_of(again.at) ||
               bits_of(touch.point.x) != bits_of(again.point.x) || bits_of(touch.normal.x) != bits_of(again.normal.x);
  ++worst.judged;
  worst.hits += does_touch;
  const Real slack = made.slack(ray), ball = truth.ball + static_cast<Real>(ray.radius);
  const Point d = point(ray.direction), at = point(ray.at);
  // No touch before the one that is reported: of the ray as it may be, which is `error` away.
  const Point true_at = at + static_cast<Real>(ray.error) * oracle::convert<Real>(random.unit_vector());
  const Real lengths = truth.reach() + norm(truth.center) + norm(at) + ball;
  const Real close = dot(truth.center - at, d), far = 4 * (lengths + slack);
  const Real begin = std::max<Real>(ray.begin, close - far);
  const Real rounding = 2 * std::numeric_limits<double>::epsilon() * std::fabs(static_cast<Real>(touch.at));
  Real end = ray.end == kInfinity ? close + far : std::min<Real>(ray.end, close + far);
  if (truth.kind == ConvexKind::kHalfSpace && ray.end == kInfinity) end = std::max<Real>(end, ray.begin + 1e6L);
  if (does_touch) end = static_cast<Real>(touch.at) - rounding;
  if (end >= begin && !(does_touch && touch.inside))
    worst.lost += least_distance(truth, true_at, d, begin, end) < ball - kJudgeRounding * lengths;
  if (!does_touch) return;

  worst.inside += touch.inside;
  worst.bad += !(touch.at >= ray.begin && touch.at <= ray.end);
  const Point x = (at - truth.center) + static_cast<Real>(touch.at) * d;
  // A half space's slack grows along the ray.
  const Real wide = truth.kind == ConvexKind::kHalfSpace
                        ? slack + static_cast<Real>(kConvexSlackDouble) * std::fabs(static_cast<Real>(touch.at))
                        : slack;
  const Real distance = norm(x - truth.nearest(x)) - ball - rounding - kJudgeRounding * lengths;
  // A sphere that is small next to a thin hull is as far from it as its normals are rounded.
  const bool is_small = truth.kind == ConvexKind::kHull && ball > 0 && distance > static_cast<Real>(kRayGrowth) * wide;
  if (is_small) {
    worst.gave_up++;
    worst.loose += distance > kHullGaveUp * truth.reach() * truth.reach() / ball;
    return;
  }
  worst.growth = std::max(worst.growth, distance / wide);
  worst.loose += distance > static_cast<Real>(kRayGrowth) * wide;
  const Point n = point(touch.normal);
  if (touch.inside) {
    worst.bad += norm(n) > 0;
    return;
  }
  worst.length = std::max(worst.length, std::fabs(norm(n) - 1));
  // Against the ray; or, of a ball that is grazed, off by what the slack can turn it.
  const Real grazing = truth.kind == ConvexKind::kHalfSpace ? static_cast<Real>(kConvexSlackDouble)
                       : ball > slack                       ? std::sqrt(8 * slack / ball)
                                                            : kTurned;
  worst.bad += !(dot(n, d) <= grazing);
  const Point contact = point(touch.point) - truth.center;
  const Real off = std::fabs(norm(contact - truth.nearest(contact)) - truth.ball);
  const Real size = norm(point(touch.point)) + std::fabs(static_cast<Real>(touch.at));
  worst.point = std::max(worst.point, (off - 2 * std::numeric_limits<double>::epsilon() * size) / wide);
}

void report(const char* what, const Worst& worst) {
  MESSAGE(std::string(what) << ": " << worst.lost << " lost, " << worst.loose << " loose, " << worst.bad << " bad, "
                            << worst.judged << " rays, " << worst.hits << " touch, " << worst.inside
                            << " inside; growth at most " << static_cast<double>(worst.growth)
                            << " slacks, points off by " << static_cast<double>(worst.point) << ", normals by "
                            << static_cast<double>(worst.length));
  CHECK(worst.lost == 0);
  CHECK(worst.gave_up * 1000 <= worst.judged);
  CHECK(worst.loose == 0);
  CHECK(worst.bad == 0);
  CHECK(worst.point <= kPointOff);
  CHECK(worst.length <= kNormalOff);
}

constexpr int kRaysPerShape = 20;

}  // namespace

TEST_CASE("no ray and no moved sphere loses the first touch of a shape, nor touches one that is clearly away") {
  const kernel::FloatMode mode;
  std::uint64_t seed = 0;
  for (const Regime regime : kRegimes)
    for (const ShapeKind kind : kKinds) {
      Worst worst;
      const bool is_slow = kind == ShapeKind::kEllipsoid || kind == ShapeKind::kConvexHull;
      for (std::uint64_t round = 0; round < rounds(is_slow ? 5 : kind == ShapeKind::kBox ? 60 : 200); ++round) {
        Random random(++seed);
        Made made;
        make_shape(random, regime, kind, made);
        for (int i = 0; i < kRaysPerShape; ++i) judge(random, made, make_ray(random, made.truth), worst);
      }
      CAPTURE(static_cast<int>(regime));
      CAPTURE(static_cast<int>(kind));
      report("shapes", worst);
    }
}

TEST_CASE("no ray and no moved sphere loses the first touch of a posed box, nor touches one that is clearly away") {
  const kernel::FloatMode mode;
  std::uint64_t seed = 1000000;
  for (const Regime regime : kRegimes) {
    Worst worst;
    for (std::uint64_t round = 0; round < rounds(60); ++round) {
      Random random(++seed);
      Made made;
      make_box(random, regime, made);
      for (int i = 0; i < kRaysPerShape; ++i) judge(random, made, make_ray(random, made.truth), worst);
    }
    CAPTURE(static_cast<int>(regime));
    report("boxes", worst);
  }
}

TEST_CASE("rays along the axes of a unit box begin inside, graze, enter and pass as they should") {
  const kernel::FloatMode mode;
  BoxAos box = {};
  for (std::size_t k = 0; k < 3; ++k) box.axis[4 * k] = box.half[k] = 1;
  const auto cast = [&](const Double3& at, double begin, double end, double radius, RayTouch* out) {
    return cast_ray({at, {1, 0, 0}, begin, end, radius, 0}, box, out);
  };
  RayTouch touch = {};
  CHECK(cast({0, 0.5, 0}, -5, kInfinity, 0, &touch));
  CHECK(touch.at == doctest::Approx(-1).epsilon(1e-12));
  CHECK(touch.normal.x == -1);
  CHECK(touch.point.y == 0.5);
  CHECK_FALSE(touch.inside);
  CHECK(cast({0, 0.5, 0}, 0, 0, 0, &touch));
  CHECK(touch.inside);
  CHECK(touch.at == 0);
  CHECK(touch.normal.x == 0);
  CHECK(cast({0, 1, 0}, -5, kInfinity, 0, &touch));  // along a face
  CHECK(cast({0, 1, 1}, -5, kInfinity, 0, &touch));  // along an edge
  CHECK(cast({0, 1, 1}, -1, -1, 0, &touch));         // at a corner, without a length
  CHECK_FALSE(cast({0, 1 + 1e-12, 0}, -5, kInfinity, 0, &touch));
  CHECK_FALSE(cast({0, 0, 0}, -5, -1 - 1e-12, 0, &touch));
  CHECK_FALSE(cast({0, 0, 0}, 1 + 1e-12, kInfinity, 0, &touch));
  CHECK(cast({0, 1.5, 0}, -5, kInfinity, 0.5, &touch));
  CHECK_FALSE(cast({0, 1.5 + 1e-12, 0}, -5, kInfinity, 0.5, &touch));
  CHECK(cast({0, 1.3, 1.4}, -5, kInfinity, 0.5 + 1e-9, &touch));  // 0.5 from an edge
  CHECK_FALSE(cast({0, 1.3, 1.4}, -5, kInfinity, 0.5 - 1e-9, &touch));
}

TEST_CASE("a sphere that grazes the end of a box whose axis is a float longer than 1 touches it") {
  const kernel::FloatMode mode;
  BoxAos box = {};
  for (std::size_t k = 0; k < 3; ++k) box.axis[4 * k] = 1;
  box.axis[0] = std::nextafter(1.0f, 2.0f);
  box.half[0] = 1;
  RayTouch touch = {};
  CHECK(cast_ray({{1 + 1.1e-6, 0, 0}, {0, 1, 0}, -1, 1, 1e-6, 0}, box, &touch));
  CHECK_FALSE(cast_ray({{1 + 1.2e-6, 0, 0}, {0, 1, 0}, -1, 1, 1e-6, 0}, box, &touch));
}
