// The judge of two convex shapes. A maximum entropy point of the difference, or a direction in which it has none,
// decides; the least distance or depth follows as the smoothing goes to 0.
#include "perf/judge/oracle/convex_judge.h"

#include "perf/judge/oracle/soft_support.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

namespace cab::oracle {
namespace {

constexpr Real kInfinity = std::numeric_limits<Real>::infinity();

// Rounding of a support in T, in parts of the size plus the distance of the shapes' origins. It is the rounding of one
// operation times more than their number.
template <class T>
constexpr T kSupportRounding = 64 * std::numeric_limits<T>::epsilon();

// Rounds of Newton's method after which a pair is too close to decide in this precision.
constexpr int kDecideRounds = 100;

// Rounds per stage of the smoothing, and the gain in parts of the smoothing below which a stage ends.
constexpr int kDistanceRounds = 40;
constexpr double kLeastGain = 1e-10;

// Distances end when the bounds are this close, in parts of the size, or when the smoothing is this small.
constexpr Real kDistanceTolerance = 1e-14L;
constexpr Real kLeastSmoothing = 1e-16L;

// Depths: the smoothing of the first and of the last stage in double, and of the last in Real, in parts of the size.
constexpr double kFirstSmoothing = 1e-2;
constexpr double kDoubleSmoothing = 1e-7;
constexpr Real kRealSmoothing = 1e-12L;

// Depths with ellipsoids and cylinders: directions that are measured, and how many descents start from the best.
constexpr int kSpiralDirections = 256;
constexpr std::size_t kDescents = 16;
constexpr double kLeastTurn = 0.15;  // radians between two starts

// Results of descents in double within this of the best, in parts of the size, are refined in Real.
constexpr double kNearBest = 1e-5;

// Directions whose depth in double is within this of the least, in parts of the size, are measured in Real.
constexpr double kNearLeast = 1e-9;

// Two arcs of normals that cross have products of the same sign, up to this.
constexpr double kArcTolerance = 1e-9;

Real radius_of(const JudgeShape& shape) {
  return shape.kind == JudgeKind::kSphere || shape.kind == JudgeKind::kCapsule ? shape.size[0] : 0;
}

// The vertices of a shape in its own frame: the shape without its body and its ball.
std::vector<Point> vertices_of(const JudgeShape& shape) {
  const Real* const s = shape.size;
  switch (shape.kind) {
    case JudgeKind::kBox: {
      std::vector<Point> out;
      for (unsigned i = 0; i < 8; ++i)
        out.push_back({{i & 1 ? s[0] : -s[0], i & 2 ? s[1] : -s[1], i & 4 ? s[2] : -s[2]}});
      return out;
    }
    case JudgeKind::kCapsule:
    case JudgeKind::kCylinder: return {{{0, 0, -s[1]}}, {{0, 0, s[1]}}};
    case JudgeKind::kHull: return {shape.vertices.begin(), shape.vertices.end()};
    default: return {{{0, 0, 0}}};
  }
}

// The faces of those vertices, for sizes of 1: normals and edges keep their directions where other sizes are put in.
HullFaces faces_of(const JudgeShape& shape) {
  if (shape.kind == JudgeKind::kHull) return shape.faces != nullptr ? *shape.faces : find_faces(shape.vertices);
  const auto unit = [](JudgeKind kind) { return find_faces(vertices_of({kind, {1, 1, 1}, {}, nullptr, {}})); };
  static const HullFaces box = unit(JudgeKind::kBox), line = unit(JudgeKind::kCapsule),
                         point = unit(JudgeKind::kSphere);
  if (shape.kind == JudgeKind::kBox) return box;
  return shape.kind == JudgeKind::kCapsule || shape.kind == JudgeKind::kCylinder ? line : point;
}

// A shape's faces where it is posed, or those of its negative. Normals of a deformed shape turn by the cofactors.
HullFaces posed_faces(const JudgeShape& shape, Real sign) {
  HullFaces out = faces_of(shape);
  Real cofactor[3][3];
  for (std::size_t k = 0; k < 3; ++k)
    store(cross(to_vec3(shape.pose.column[(k + 1) % 3]), to_vec3(shape.pose.column[(k + 2) % 3])), cofactor[k]);
  const Real handed = dot(to_vec3(shape.pose.column[0]), to_vec3(cofactor[0])) < 0 ? -sign : sign;
  const auto pose = [&](Point& normal) {
    const Point turned = rotated(cofactor, normal);
    normal = (handed / length(turned)) * turned;
  };
  for (Point& normal : out.normals) pose(normal);
  for (HullEdge& edge : out.edges) {
    edge.along = rotated(shape.pose.column, edge.along);
    for (Point& normal : edge.normal) pose(normal);
  }
  return out;
}

// sign times the posed shape, moved by `at`.
Side<Real> side_of(const JudgeShape& shape, const Point& at, Real sign) {
  Side<Real> out;
  out.vertices = vertices_of(shape);
  Point center{};
  for (Point& v : out.vertices) {
    v = sign * (at + rotated(shape.pose.column, v));
    center = center + v;
  }
  center = (Real{1} / static_cast<Real>(out.vertices.size())) * center;
  for (const Point& v : out.vertices) out.diameter = larger(out.diameter, 2 * length(v - center));
  if (shape.kind == JudgeKind::kEllipsoid || shape.kind == JudgeKind::kCylinder) {
    const bool is_disc = shape.kind == JudgeKind::kCylinder;
    const Real radii[3] = {shape.size[0], shape.size[is_disc ? 0 : 1], is_disc ? 0 : shape.size[2]};
    for (std::size_t k = 0; k < 3; ++k) out.body.axis[k] = radii[k] * to_vec3(shape.pose.column[k]);
    for (const Point& axis : out.body.axis) out.body.extent += dot(axis, axis);
    out.body.extent = std::sqrt(out.body.extent);
  }
  return out;
}

// a less b, in a frame at a's origin.
Difference<Real> difference_of(const JudgeShape& a, const JudgeShape& b) {
  const Point offset = b.pose.at - a.pose.at;
  Difference<Real> out;
  out.side[0] = side_of(a, {}, 1);
  out.side[1] = side_of(b, offset, -1);
  out.radius = radius_of(a) + radius_of(b);
  for (std::size_t k = 0; k < 3; ++k) out.ball.axis[k][k] = out.radius;
  out.ball.extent = std::sqrt(Real{3}) * out.radius;
  Real furthest = 0;
  for (const Side<Real>& side : out.side) {
    out.size += side.diameter + 2 * side.body.extent;
    for (const Point& v : side.vertices) furthest = larger(furthest, length(v));
  }
  out.size += 2 * out.radius;
  out.noise = kSupportRounding<Real> * (out.size + furthest);
  return out;
}

Body<double> rounded(const Body<Real>& body) {
  Body<double> out;
  for (std::size_t k = 0; k < 3; ++k) out.axis[k] = convert<double>(body.axis[k]);
  out.extent = static_cast<double>(body.extent);
  return out;
}

Difference<double> rounded(const Difference<Real>& difference) {
  Difference<double> out;
  for (std::size_t k = 0; k < 2; ++k) {
    for (const Point& v : difference.side[k].vertices) out.side[k].vertices.push_back(convert<double>(v));
    out.side[k].body = rounded(difference.side[k].body);
    out.side[k].diameter = static_cast<double>(difference.side[k].diameter);
  }
  out.ball = rounded(difference.ball);
  out.radius = static_cast<double>(difference.radius);
  out.size = static_cast<double>(difference.size);
  out.noise = static_cast<double>(difference.noise / kSupportRounding<Real>) * kSupportRounding<double>;
  return out;
}

enum class Answer { kUndecided, kApart, kOverlap };

template <class T>
struct Decision {
  Answer answer = Answer::kUndecided;
  Vec3<T> direction{};    // apart: one that separates, of length 1; else the last one tried
  Vec3<T> point[2] = {};  // of each side; overlapping: their sum and a point of the balls sum to 0
  T depth = 0;            // overlapping: a ball of this radius fits around a common point
};

// The largest ball, to a factor of 2, that `softened` proves to be in the difference around 0; 0 if there is none.
template <class T>
T proven_depth(const Softened<T>& softened, T away) {
  const auto holds = [&](const T& depth) {
    Symmetric<T> rest = softened.margin;
    rest.add_diagonal(-away - depth);
    return Cholesky<T>(rest).positive;
  };
  if (!holds(0)) return 0;
  T depth = softened.margin.trace() / 3;
  while (depth > away && !holds(depth)) depth /= 2;
  return depth > away ? depth : 0;
}

// Once an overlap is proven, the rounds go on until the points of the sides name a common point.
template <class T>
Decision<T> decide(Difference<T>& difference, Balls balls) {
  const T radius = balls == Balls::kCounted ? difference.radius : T(0);
  Decision<T> out;
  const auto separates = [&](const Vec3<T>& z) {
    const T norm = length(z);
    if (!(norm > 0)) return false;
    const Vec3<T> d = (1 / norm) * z;
    if (!(support(difference, d) + radius < -difference.noise)) return false;
    out.answer = Answer::kApart;
    out.direction = d;
    return true;
  };
  bool is_first = true;
  minimise(difference, Vec3<T>{}, T(1), T(0), balls, kDecideRounds, T(0),
           [&](const Vec3<T>& z, const Softened<T>& softened) {
             const T away = length(softened.gradient);
             out.point[0] = softened.point[0];
             out.point[1] = softened.point[1];
             if (out.answer == Answer::kOverlap) return away <= difference.noise;
             if (length(z) > 0) out.direction = (1 / length(z)) * z;
             if (is_first ? separates(T(-1) * softened.gradient) : separates(z)) return true;
             is_first = false;
             out.depth = proven_depth(softened, away + difference.noise);
             if (out.depth > 0) out.answer = Answer::kOverlap;
             return out.answer == Answer::kOverlap && away <= difference.noise;
           });
  return out;
}

Decision<Real> widened(const Decision<double>& from) {
  Decision<Real> out;
  out.answer = from.answer;
  out.direction = convert<Real>(from.direction);
  if (const Real norm = length(out.direction); norm > 0) out.direction = (1 / norm) * out.direction;
  for (std::size_t k = 0; k < 2; ++k) out.point[k] = convert<Real>(from.point[k]);
  out.depth = static_cast<Real>(from.depth);
  return out;
}

// Two shapes under judgement.
struct Case {
  const JudgeShape& a;
  const JudgeShape& b;
  Difference<Real> exact;
  Difference<double> coarse;

  Decision<Real> decide_pair(Balls balls) {
    const Decision<double> first = decide(coarse, balls);
    return first.answer != Answer::kUndecided ? widened(first) : decide(exact, balls);
  }
};

// The gap along a direction of length 1.
Real gap_along(const Case& pair, const Point& d) { return -support(pair.exact, d) - pair.exact.radius; }

// Fills in what two points of the shapes without balls, relative to a's origin, say about the shapes.
void take_points(const Case& pair, const Point& x, const Point& y, Verdict& out) {
  const Point between = y - x;
  const Real distance = length(between), radius_a = radius_of(pair.a), radius_b = radius_of(pair.b);
  out.gap_at_most = distance - pair.exact.radius;
  const Point along = distance > 0 ? (1 / distance) * between : out.normal;
  const Point origin = pair.a.pose.at;
  out.on_a = origin + x + radius_a * along;
  out.on_b = origin + y - radius_b * along;
  out.common = origin + x;
  if (pair.exact.radius > 0) out.common = out.common + radius_a / pair.exact.radius * between;
}

// The furthest point of a side, without its ball, along a direction.
Point furthest_point(const Side<Real>& side, const Point& d) {
  Point out = side.vertices.front();
  for (const Point& v : side.vertices)
    if (dot(v, d) > dot(out, d)) out = v;
  const Point along = side.body.along(d);
  const Real norm = length(along);
  return norm > 0 ? out + side.body.point((1 / norm) * along) : out;
}

// Shrinks the bounds of the distance of shapes that are apart without their balls: Newton's method for the distance of
// the smoothed shapes, from z, while the smoothing falls from `from` to `to`. distance: roughly theirs, or more.
template <class T>
Vec3<T> approach(Difference<T>& difference, Vec3<T> z, T from, T to, Real distance, Verdict& best, Case& pair) {
  for (T part = from; part > to; part *= T(0.2)) {
    const T mu = part * difference.size * static_cast<T>(distance);
    if (!(mu > 0)) break;
    const auto never = [](const Vec3<T>&, const Softened<T>&) { return false; };
    z = minimise(difference, z, mu, T(1), Balls::kLeftOut, kDistanceRounds, T(kLeastGain) * mu, never);
    Softened<T> last = soften(difference, z, mu, Balls::kLeftOut);
    if (length(z) > 0) balance(difference, (1 / length(z)) * z, last);
    const Point x = convert<Real>(last.point[0]), y = Real{-1} * convert<Real>(last.point[1]);
    distance = std::fmin(distance, length(y - x));
    if (length(y - x) - pair.exact.radius < best.gap_at_most) take_points(pair, x, y, best);
    const Vec3<T> candidates[2] = {z, T(-1) * (last.point[0] + last.point[1])};
    for (const Vec3<T>& candidate : candidates) {
      const Point d = convert<Real>(candidate);
      const Real norm = length(d);
      if (!(norm > 0)) continue;
      const Real gap = gap_along(pair, (1 / norm) * d);
      if (!(gap > best.gap_at_least)) continue;
      best.gap_at_least = gap;
      best.normal = (1 / norm) * d;
    }
    if (best.gap_at_most - best.gap_at_least <= kDistanceTolerance * pair.exact.size) break;
  }
  return z;
}

// The distance of shapes that `found` parts, or may part, without their balls.
Verdict measure_distance(Case& pair, const Decision<Real>& found) {
  Verdict out{};
  out.normal = found.direction;
  out.gap_at_least = gap_along(pair, found.direction);
  take_points(pair, found.point[0], Real{-1} * found.point[1], out);
  const Real gap = out.gap_at_least + pair.exact.radius, distance = length(found.point[0] + found.point[1]);
  const Vec3<double> start = convert<double>((gap > 0 ? gap : distance) * found.direction);
  const Vec3<double> z = approach(pair.coarse, start, 0.3, kDoubleSmoothing, distance, out, pair);
  // Points in double lie on shapes that are rounded.
  const Real least = out.gap_at_most + pair.exact.radius;
  out.gap_at_most += static_cast<Real>(pair.coarse.noise);
  approach(pair.exact, convert<Real>(z), static_cast<Real>(kDoubleSmoothing), kLeastSmoothing, least, out, pair);
  return out;
}

// Whether the arcs of normals of two edges cross on the sphere, so that the edges span a face of the difference. One is
// an edge of a, the other of the negative of b.
bool arcs_cross(const Vec3<double> (&p)[2], const Vec3<double> (&q)[2]) {
  const Vec3<double> across_p = cross(p[0], p[1]), across_q = cross(q[0], q[1]);
  const double q_0 = dot(across_p, q[0]), q_1 = dot(across_p, q[1]);
  const double p_0 = dot(across_q, p[0]), p_1 = dot(across_q, p[1]);
  return q_0 * q_1 <= kArcTolerance && p_0 * p_1 <= kArcTolerance && q_0 * p_1 >= -kArcTolerance;
}

// All directions that can have the least depth of two polytopes: normals of the faces of the difference.
std::vector<Point> face_directions(const HullFaces& a, const HullFaces& b) {
  std::vector<Point> out = a.normals;
  out.insert(out.end(), b.normals.begin(), b.normals.end());
  std::vector<Vec3<double>> arcs;
  for (const HullEdge& edge : b.edges)
    for (const Point& normal : edge.normal) arcs.push_back(convert<double>(normal));
  for (const HullEdge& edge : a.edges) {
    const Vec3<double> p[2] = {convert<double>(edge.normal[0]), convert<double>(edge.normal[1])};
    for (std::size_t i = 0; i < b.edges.size(); ++i) {
      const Vec3<double> q[2] = {arcs[2 * i], arcs[2 * i + 1]};
      if (!arcs_cross(p, q)) continue;
      const Point normal = cross(edge.along, b.edges[i].along);
      const Real norm = length(normal);
      if (!(norm > kSupportRounding<Real> * length(edge.along) * length(b.edges[i].along))) continue;
      out.push_back((1 / norm) * normal);
      out.push_back((-1 / norm) * normal);
    }
  }
  return out;
}

// The direction with the largest gap of those given, each of length 1.
Point best_of(const Case& pair, const std::vector<Point>& directions) {
  std::vector<double> reach;
  reach.reserve(directions.size());
  for (const Point& d : directions) reach.push_back(support(pair.coarse, convert<double>(d)));
  const double limit = *std::min_element(reach.begin(), reach.end()) + kNearLeast * pair.coarse.size;
  Point best = directions.front();
  Real gap = -kInfinity;
  for (std::size_t i = 0; i < directions.size(); ++i) {
    if (reach[i] > limit) continue;
    const Real here = gap_along(pair, directions[i]);
    if (here <= gap) continue;
    gap = here;
    best = directions[i];
  }
  return best;
}

// Directions from which descents start: those of an even spiral, the axes of bodies, and the directions of least
// depth of the shapes without bodies.
std::vector<Vec3<double>> start_directions(const Case& pair, const HullFaces& a, const HullFaces& b) {
  std::vector<Vec3<double>> out;
  for (const Point& normal : face_directions(a, b)) out.push_back(convert<double>(normal));
  for (const Side<double>& side : pair.coarse.side) {
    for (const Vec3<double>& axis : side.body.axis) {
      if (!(length(axis) > 0)) continue;
      for (const double sign : {-1.0, 1.0}) out.push_back(sign / length(axis) * axis);
    }
  }
  // The axis of a cylinder, whose body has none along it.
  for (const JudgeShape* const shape : {&pair.a, &pair.b}) {
    if (shape->kind != JudgeKind::kCylinder) continue;
    const Vec3<double> axis = convert<double>(cross(to_vec3(shape->pose.column[0]), to_vec3(shape->pose.column[1])));
    for (const double sign : {-1.0, 1.0}) out.push_back(sign / length(axis) * axis);
  }
  const double golden = std::numbers::pi * (3 - std::sqrt(5.0));
  for (int i = 0; i < kSpiralDirections; ++i) {
    const double z = 1 - (2 * i + 1) / static_cast<double>(kSpiralDirections), radius = std::sqrt(1 - z * z);
    out.push_back({{radius * std::cos(golden * i), radius * std::sin(golden * i), z}});
  }
  return out;
}

// The direction of the least depth that descents find from the best start directions, which count too.
Point refined_direction(Case& pair, const HullFaces& a, const HullFaces& b) {
  const std::vector<Vec3<double>> starts = start_directions(pair, a, b);
  std::vector<std::pair<double, Vec3<double>>> ranked;
  ranked.reserve(starts.size());
  for (const Vec3<double>& d : starts) ranked.emplace_back(support(pair.coarse, d), d);
  const auto by_support = [](const auto& left, const auto& right) { return left.first < right.first; };
  std::stable_sort(ranked.begin(), ranked.end(), by_support);
  std::vector<std::pair<double, Vec3<double>>> results = {ranked.front()};
  std::vector<Vec3<double>> taken;
  for (const auto& [reach, d] : ranked) {
    if (taken.size() == kDescents) break;
    const bool is_near = std::any_of(taken.begin(), taken.end(), [&d = d](const Vec3<double>& other) {
      return dot(other, d) > std::cos(kLeastTurn);
    });
    if (is_near) continue;
    taken.push_back(d);
    const Vec3<double> end = descend(pair.coarse, d, kFirstSmoothing, kDoubleSmoothing);
    results.emplace_back(support(pair.coarse, end), end);
  }
  std::stable_sort(results.begin(), results.end(), by_support);
  std::vector<Point> directions;
  for (const auto& [reach, d] : results) {
    if (reach > results.front().first + kNearBest * pair.coarse.size) break;
    const Point exact = (1 / length(convert<Real>(d))) * convert<Real>(d);
    const bool is_known = std::any_of(directions.begin(), directions.end(), [&](const Point& other) {
      return norm_max(other - exact) < static_cast<Real>(kNearBest);
    });
    if (is_known) continue;
    directions.push_back(exact);
    directions.push_back(descend(pair.exact, exact, static_cast<Real>(kDoubleSmoothing), kRealSmoothing));
  }
  Point best = directions.front();
  for (const Point& d : directions)
    if (gap_along(pair, d) > gap_along(pair, best)) best = d;
  return best;
}

// The depth of shapes that overlap, or may overlap, without their balls.
Verdict measure_depth(Case& pair, const Decision<Real>& found) {
  const HullFaces a = posed_faces(pair.a, 1), b = posed_faces(pair.b, -1);
  const bool has_body = pair.exact.side[0].body.extent > 0 || pair.exact.side[1].body.extent > 0;
  Verdict out{};
  out.is_refined = has_body;
  out.normal = has_body ? refined_direction(pair, a, b) : best_of(pair, face_directions(a, b));
  out.gap_at_least = gap_along(pair, out.normal);
  take_points(pair, found.point[0], Real{-1} * found.point[1], out);
  if (found.answer == Answer::kOverlap) out.gap_at_most = out.gap_at_least;
  return out;
}

Verdict measure(Case& pair, const Decision<Real>& found) {
  if (found.answer == Answer::kOverlap) return measure_depth(pair, found);
  const Verdict distance = measure_distance(pair, found);
  if (found.answer == Answer::kApart || distance.gap_at_least + pair.exact.radius > pair.exact.noise) return distance;
  Verdict out = measure_depth(pair, found);
  if (distance.gap_at_least > out.gap_at_least) {
    out.gap_at_least = distance.gap_at_least;
    out.normal = distance.normal;
  }
  if (distance.gap_at_most < out.gap_at_most) {
    out.gap_at_most = distance.gap_at_most;
    out.on_a = distance.on_a;
    out.on_b = distance.on_b;
    out.common = distance.common;
  }
  return out;
}

// What a decision proves, without a search for the least distance or depth.
Verdict decided(const Case& pair, const Decision<Real>& found) {
  Verdict out{};
  const Point between = Real{-1} * (found.point[0] + found.point[1]);
  const Real norm = length(between);
  out.normal = {{0, 0, 1}};
  if (found.answer == Answer::kApart)
    out.normal = found.direction;
  else if (norm > 0)
    out.normal = (1 / norm) * between;
  out.gap_at_least = gap_along(pair, out.normal);
  take_points(pair, found.point[0], Real{-1} * found.point[1], out);
  // Points in double lie on shapes that are rounded.
  out.gap_at_most =
      found.answer == Answer::kOverlap ? -found.depth : out.gap_at_most + static_cast<Real>(pair.coarse.noise);
  return out;
}

// The half space is a if sign is 1, or b if sign is -1.
Verdict judge_half_space(const JudgeShape& half, const JudgeShape& other, Real sign) {
  Verdict out{-kInfinity, kInfinity, {}, {}, {}, {}, false};
  if (other.kind == JudgeKind::kHalfSpace) return out;
  const Point up = posed_faces(half, 1).normals.front();
  const Point offset = other.pose.at - half.pose.at;
  const Point lowest = furthest_point(side_of(other, offset, 1), Real{-1} * up) - radius_of(other) * up;
  const Real gap = dot(up, lowest);
  const Point of_other = half.pose.at + lowest, of_half = of_other - gap * up;
  out = {gap, gap, sign * up, of_half, of_other, of_other, false};
  if (sign < 0) std::swap(out.on_a, out.on_b);
  return out;
}

}  // namespace

Verdict judge(const JudgeShape& a, const JudgeShape& b, Effort effort) {
  if (a.kind == JudgeKind::kHalfSpace) return judge_half_space(a, b, 1);
  if (b.kind == JudgeKind::kHalfSpace) return judge_half_space(b, a, -1);
  Case pair{a, b, difference_of(a, b), {}};
  pair.coarse = rounded(pair.exact);
  const Decision<Real> found = pair.decide_pair(Balls::kCounted);
  if (effort == Effort::kDecide && found.answer != Answer::kUndecided) return decided(pair, found);
  const Decision<Real> bare = pair.exact.radius > 0 ? pair.decide_pair(Balls::kLeftOut) : found;
  Verdict out = measure(pair, bare);
  if (overlap(out)) {
    const Point origin = a.pose.at;
    out.on_a = origin + furthest_point(pair.exact.side[0], out.normal) + radius_of(a) * out.normal;
    out.on_b = origin - furthest_point(pair.exact.side[1], out.normal) - radius_of(b) * out.normal;
  }
  return out;
}

}  // namespace cab::oracle
