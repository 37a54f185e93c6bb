// The judge of convex shapes against answers in closed form, and against its own proofs.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "perf/judge/oracle/convex_judge.h"
#include "perf/judge/oracle/random.h"
#include "tests/rounds.h"

namespace {

using cab::oracle::are_apart;
using cab::oracle::convert;
using cab::oracle::dot;
using cab::oracle::Effort;
using cab::oracle::ExactPose;
using cab::oracle::find_faces;
using cab::oracle::HullFaces;
using cab::oracle::judge;
using cab::oracle::JudgeKind;
using cab::oracle::JudgeShape;
using cab::oracle::overlap;
using cab::oracle::Point;
using cab::oracle::Random;
using cab::oracle::Real;
using cab::oracle::rotated;
using cab::oracle::store;
using cab::oracle::to_vec3;
using cab::oracle::Vec3;
using cab::oracle::Verdict;
using cab::tests::rounds;

// Errors in parts of the size. The worst measured: distances 3e-13, depths of polytopes 2e-16, of others 4e-15.
constexpr Real kDistanceTolerance = 1e-12L;
constexpr Real kDepthTolerance = 1e-15L;
constexpr Real kSmoothDepthTolerance = 1e-10L;

// What rounding may move a bound by, for shapes of size 1 within 4 of each other; the worst measured is 9e-19.
constexpr Real kRounding = 4e-17L;

// What the judge adds to the distance of points that it found in double, for the same shapes; at most 2e-13.
constexpr Real kDoubleSlack = 1e-12L;

// What a point of a shape may be outside of it, in parts of the size; the worst measured is 8e-16.
constexpr Real kPointTolerance = 1e-13L;

JudgeShape box(Real x, Real y, Real z) { return {JudgeKind::kBox, {x, y, z}, {}, nullptr, JudgeShape{}.pose}; }
JudgeShape sphere(Real r) { return {JudgeKind::kSphere, {r}, {}, nullptr, JudgeShape{}.pose}; }
JudgeShape ellipsoid(Real x, Real y, Real z) {
  return {JudgeKind::kEllipsoid, {x, y, z}, {}, nullptr, JudgeShape{}.pose};
}
JudgeShape capsule(Real r, Real half) { return {JudgeKind::kCapsule, {r, half}, {}, nullptr, JudgeShape{}.pose}; }
JudgeShape cylinder(Real r, Real half) { return {JudgeKind::kCylinder, {r, half}, {}, nullptr, JudgeShape{}.pose}; }
JudgeShape half_space() { return {JudgeKind::kHalfSpace, {}, {}, nullptr, JudgeShape{}.pose}; }
JudgeShape hull(const std::vector<Point>& vertices) {
  return {JudgeKind::kHull, {}, vertices, nullptr, JudgeShape{}.pose};
}

JudgeShape at(JudgeShape shape, Real x, Real y, Real z) {
  shape.pose.at = {{x, y, z}};
  return shape;
}

// The shape turned about a coordinate axis through its own origin, by an angle in radians.
JudgeShape turned(JudgeShape shape, std::size_t axis, Real angle) {
  ExactPose turn{};
  const Real c = std::cos(angle), s = std::sin(angle);
  const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
  turn.column[axis][axis] = 1;
  turn.column[u][u] = turn.column[v][v] = c;
  turn.column[u][v] = s;
  turn.column[v][u] = -s;
  for (auto& column : shape.pose.column) store(rotated(turn.column, to_vec3(column)), column);
  return shape;
}

// The shape with the whole world moved by a pose.
JudgeShape moved(JudgeShape shape, const ExactPose& by) {
  for (auto& column : shape.pose.column) store(rotated(by.column, to_vec3(column)), column);
  shape.pose.at = by.at + rotated(by.column, shape.pose.at);
  return shape;
}

ExactPose random_pose(Random& random, double distance) {
  ExactPose out{};
  double axis[3][3];
  random.rotation(axis);
  for (std::size_t k = 0; k < 3; ++k) store(convert<Real>(to_vec3(axis[k])), out.column[k]);
  out.at = convert<Real>(random.uniform(0, distance) * random.unit_vector());
  return out;
}

Real largest_size(const JudgeShape& shape) {
  Real out = std::max({shape.size[0], shape.size[1], shape.size[2]});
  for (const Point& v : shape.vertices) out = std::max(out, std::sqrt(dot(v, v)));
  return out;
}

// Judges a and b both ways and in turned worlds, and checks the gap each time.
void check_gap(const JudgeShape& a, const JudgeShape& b, Real expected, Real tolerance) {
  Random random(12);
  const Real bound = tolerance * (largest_size(a) + largest_size(b) + std::fabs(expected));
  for (int turn = 0; turn < 4; ++turn) {
    ExactPose world = random_pose(random, 5);
    if (turn == 0) world = JudgeShape{}.pose;
    const JudgeShape first = moved(turn % 2 == 0 ? a : b, world), second = moved(turn % 2 == 0 ? b : a, world);
    const Verdict verdict = judge(first, second, Effort::kMeasure);
    CAPTURE(turn);
    CAPTURE(static_cast<double>(expected));
    CHECK(std::fabs(static_cast<double>(verdict.gap_at_least - expected)) <= static_cast<double>(bound));
    CHECK(std::fabs(static_cast<double>(verdict.gap_at_most - expected)) <= static_cast<double>(bound));
    if (std::fabs(expected) <= bound) continue;
    CHECK(are_apart(verdict) == (expected > 0));
    CHECK(overlap(verdict) == (expected < 0));
    const Verdict quick = judge(first, second, Effort::kDecide);
    CHECK(are_apart(quick) == (expected > 0));
    CHECK(overlap(quick) == (expected < 0));
    CHECK(quick.gap_at_least <= verdict.gap_at_least + bound);
    CHECK(quick.gap_at_most >= verdict.gap_at_most - bound);
  }
}

TEST_CASE("spheres, capsules and boxes along their axes have the gaps of schoolbooks") {
  for (const Real gap : {2.0L, 1e-3L, 1e-6L, -1e-6L, -0.25L}) {
    check_gap(sphere(1), at(sphere(2), 3 + gap, 0, 0), gap, kDepthTolerance);
    check_gap(capsule(1, 3), at(capsule(0.5L, 1), 1.5L + gap, 0, 1), gap, kDistanceTolerance);
    check_gap(capsule(1, 3), at(capsule(0.5L, 1), 0, 0, 5.5L + gap), gap, kDistanceTolerance);
    check_gap(capsule(1, 3), turned(at(capsule(0.5L, 1), 1.5L + gap, 0, 0), 0, std::numbers::pi_v<Real> / 2), gap,
              kDistanceTolerance);
    check_gap(box(1, 2, 3), at(box(1, 1, 1), 2 + gap, 0.5L, 1), gap, kDistanceTolerance);
    check_gap(box(1, 2, 3), at(sphere(0.5L), 0.5L, 2.5L + gap, 1), gap, kDistanceTolerance);
    check_gap(box(1, 2, 3), at(capsule(0.5L, 1), 1.5L + gap, 0, 1), gap, kDistanceTolerance);
  }
}

TEST_CASE("a turned box touches with an edge or a corner") {
  const Real root_2 = std::sqrt(2.0L), eighth = std::numbers::pi_v<Real> / 4;
  for (const Real gap : {1.0L, 1e-6L, -1e-6L, -0.1L}) {
    check_gap(box(1, 1, 1), turned(at(box(1, 1, 1), 1 + root_2 + gap, 0, 0), 2, eighth), gap, kDistanceTolerance);
    // Edge against edge: one box is turned about z, the other about y.
    check_gap(turned(box(1, 1, 1), 2, eighth), turned(at(box(1, 1, 1), 2 * root_2 + gap, 0, 0), 1, eighth), gap,
              kDistanceTolerance);
    // A corner along (1, 1, 1) turns onto x.
    const JudgeShape corner = turned(turned(box(1, 1, 1), 2, -eighth), 1, std::atan(1 / root_2));
    check_gap(box(1, 1, 1), at(corner, 1 + std::sqrt(3.0L) + gap, 0, 0), gap, kDistanceTolerance);
  }
  // Corner against corner.
  check_gap(box(1, 1, 1), at(box(1, 1, 1), 3, 3, 3), std::sqrt(3.0L), kDistanceTolerance);
}

TEST_CASE("ellipsoids and cylinders have known gaps along their axes") {
  const Real quarter = std::numbers::pi_v<Real> / 2;
  for (const Real gap : {1.0L, 1e-6L, -1e-6L, -0.1L}) {
    check_gap(ellipsoid(1, 2, 3), at(half_space(), 0, 0, -3 - gap), gap, kDepthTolerance);
    check_gap(ellipsoid(1, 2, 3), at(ellipsoid(2, 1, 1), 3 + gap, 0, 0), gap, kSmoothDepthTolerance);
    check_gap(ellipsoid(1, 2, 3), at(sphere(1), 0, 3 + gap, 0), gap,
              gap > 0 ? kDistanceTolerance : kSmoothDepthTolerance);
    check_gap(ellipsoid(1, 1, 1), at(sphere(2), 1, 2, 2 + gap / 10), std::sqrt(5 + (2 + gap / 10) * (2 + gap / 10)) - 3,
              kSmoothDepthTolerance);
    check_gap(ellipsoid(1, 2, 3), at(box(1, 1, 1), 2 + gap, 0, 0), gap, kSmoothDepthTolerance);
    check_gap(cylinder(1, 2), at(cylinder(0.5L, 1), 1.5L + gap, 0, 0.5L), gap, kSmoothDepthTolerance);
    check_gap(cylinder(1, 2), at(cylinder(0.5L, 1), 0.2L, 0, 3 + gap), gap, kSmoothDepthTolerance);
    check_gap(cylinder(1, 2), turned(at(cylinder(0.5L, 1), 1.5L + gap, 0, 0), 0, quarter), gap, kSmoothDepthTolerance);
    check_gap(cylinder(1, 2), at(sphere(1), 0, 0, 3 + gap), gap, kSmoothDepthTolerance);
    check_gap(cylinder(1, 2), at(box(1, 1, 1), 0.3L, 0, 3 + gap), gap, kSmoothDepthTolerance);
    check_gap(cylinder(1, 2), turned(at(half_space(), -1 - gap, 0, 0), 1, quarter), gap, kDepthTolerance);
  }
  // The rim of a cylinder, (1, 2) in the plane of y = 0, against a sphere 3 and 4 away.
  check_gap(cylinder(1, 2), at(sphere(1), 4, 0, 6), 4, kDistanceTolerance);
}

TEST_CASE("the gap to a half space is the height of the lowest point") {
  const std::vector<Point> tip = {{{0, 0, -2}}, {{1, 1, 3}}, {{-1, 1, 3}}, {{0, -1, 3}}};
  for (const Real height : {3.0L, 1e-6L, -1e-6L, -4.0L}) {
    check_gap(half_space(), at(sphere(1), 5, 5, 1 + height), height, kDepthTolerance);
    check_gap(half_space(), at(box(1, 2, 3), 5, 5, 3 + height), height, kDepthTolerance);
    check_gap(half_space(), at(capsule(1, 3), 5, 5, 4 + height), height, kDepthTolerance);
    check_gap(half_space(), at(hull(tip), 5, 5, 2 + height), height, kDepthTolerance);
  }
  const Verdict two = judge(half_space(), at(half_space(), 0, 0, 5), Effort::kMeasure);
  CHECK(!are_apart(two));
  CHECK(!overlap(two));
}

TEST_CASE("needles and plates keep their gaps") {
  const Real quarter = std::numbers::pi_v<Real> / 2;
  for (const Real gap : {1.0L, 1e-6L, -1e-6L}) {
    check_gap(ellipsoid(1e-3L, 1e-3L, 1), at(ellipsoid(1, 1, 1e-3L), 0, 0, 1.001L + gap), gap, kSmoothDepthTolerance);
    check_gap(capsule(1e-3L, 1), turned(at(capsule(1e-3L, 1), 2e-3L + gap, 0, 0), 0, quarter), gap, kDistanceTolerance);
    check_gap(box(1, 1, 1e-3L), at(box(1, 1, 1e-3L), 0.5L, 0.5L, 2e-3L + gap), gap, kDistanceTolerance);
    check_gap(cylinder(1e-3L, 1), at(box(1, 1e-3L, 1), 1.001L + gap, 0, 0.5L), gap, kSmoothDepthTolerance);
  }
  // Crossed needles part over their thickness.
  check_gap(box(1e-3L, 1e-3L, 1), turned(box(1e-3L, 1e-3L, 1), 0, quarter), -2e-3L, kDepthTolerance);
  check_gap(capsule(1e-3L, 1), turned(capsule(1e-3L, 1), 0, quarter), -2e-3L, kDepthTolerance);
}

TEST_CASE("the same shape twice in one place is as deep as it is thin") {
  check_gap(sphere(1), sphere(1), -2, kDepthTolerance);
  check_gap(capsule(1, 2), capsule(1, 2), -2, kDepthTolerance);
  check_gap(box(1, 2, 3), box(1, 2, 3), -2, kDepthTolerance);
  check_gap(ellipsoid(1, 2, 3), ellipsoid(1, 2, 3), -2, kSmoothDepthTolerance);
  check_gap(cylinder(1, 2), cylinder(1, 2), -2, kSmoothDepthTolerance);
  check_gap(cylinder(2, 1), cylinder(2, 1), -2, kSmoothDepthTolerance);
}

TEST_CASE("a shape within another parts over the shortest way out") {
  check_gap(box(4, 5, 6), at(sphere(1), 2, 0, 0), -3, kDepthTolerance);
  check_gap(box(4, 5, 6), at(box(1, 1, 1), 0, 3, 0), -3, kDepthTolerance);
  check_gap(box(4, 5, 6), at(ellipsoid(1, 2, 3), 0, 0, 5), -4, kSmoothDepthTolerance);
  check_gap(sphere(5), at(capsule(1, 1), 0, 0, 2), -5, kDepthTolerance);
  check_gap(cylinder(4, 9), at(sphere(1), 2, 0, 0), -3, kSmoothDepthTolerance);
}

std::vector<Point> corners(Real x, Real y, Real z) {
  std::vector<Point> out;
  for (unsigned i = 0; i < 8; ++i) out.push_back({{i & 1 ? x : -x, i & 2 ? y : -y, i & 4 ? z : -z}});
  return out;
}

TEST_CASE("a hull of a box's corners gets the box's verdict against every kind") {
  Random random(3);
  const std::vector<Point> vertices = corners(1, 2, 0.5L);
  const HullFaces faces = find_faces(vertices);
  const JudgeShape others[] = {box(1, 1, 2), sphere(1), ellipsoid(1, 2, 0.5L), capsule(0.5L, 1), cylinder(1, 0.5L)};
  for (int round = 0; round < 20; ++round) {
    for (const JudgeShape& other : others) {
      const ExactPose pose = random_pose(random, 1), far = random_pose(random, 5);
      JudgeShape as_hull = moved(hull(vertices), pose);
      as_hull.faces = round % 2 == 0 ? &faces : nullptr;
      const Verdict of_box = judge(moved(box(1, 2, 0.5L), pose), moved(other, far), Effort::kMeasure);
      const Verdict of_hull = judge(as_hull, moved(other, far), Effort::kMeasure);
      CHECK(are_apart(of_box) == are_apart(of_hull));
      const Real tolerance = 5 * (of_box.is_refined ? kSmoothDepthTolerance : kDistanceTolerance);
      CHECK(static_cast<double>(std::fabs(of_box.gap_at_least - of_hull.gap_at_least)) <=
            static_cast<double>(tolerance));
    }
  }
}

TEST_CASE("hulls in a plane, in a line or in one point have gaps too") {
  const std::vector<Point> triangle = {{{-1, -1, 0}}, {{2, -1, 0}}, {{-1, 2, 0}}};
  const std::vector<Point> line = {{{-1, 0, 0}}, {{0.5L, 0, 0}}, {{1, 0, 0}}};
  const std::vector<Point> point = {{{0, 0, 0}}};
  for (const Real gap : {1.0L, 1e-6L, -1e-6L, -0.1L}) {
    check_gap(hull(triangle), at(box(1, 1, 1), 0, 0, 1 + gap), gap, kDistanceTolerance);
    check_gap(hull(triangle), at(sphere(1), 0, 0, 1 + gap), gap, kDistanceTolerance);
    check_gap(hull(triangle), at(ellipsoid(1, 1, 2), 0, 0, 2 + gap), gap, kSmoothDepthTolerance);
    check_gap(hull(triangle), at(cylinder(1, 2), 0, 0, 2 + gap), gap, kSmoothDepthTolerance);
    check_gap(hull(line), at(box(1, 1, 1), 0, 0, 1 + gap), gap, kDistanceTolerance);
    check_gap(hull(line), at(capsule(1, 1), 0, 1 + gap, 0), gap, kDistanceTolerance);
    check_gap(hull(point), at(box(1, 2, 3), 1 + gap, 1, 1), gap, kDistanceTolerance);
    check_gap(hull(point), at(ellipsoid(1, 2, 3), 0, 2 + gap, 0), gap, kSmoothDepthTolerance);
  }
  // Flat against flat: through each other, side by side, and in one plane.
  check_gap(hull(triangle), turned(at(hull(line), 0, 0, 0.25L), 1, std::numbers::pi_v<Real> / 2), -std::sqrt(0.5L),
            kDepthTolerance);
  check_gap(hull(triangle), at(hull(triangle), 0, 0, 3), 3, kDistanceTolerance);
  check_gap(hull(triangle), at(hull(triangle), 4, 0, 0), 1, kDistanceTolerance);
  check_gap(hull(point), at(hull(point), 0, 3, 4), 5, kDistanceTolerance);
  const Verdict in_one_plane = judge(hull(triangle), hull(triangle), Effort::kMeasure);
  CHECK(!are_apart(in_one_plane));
  CHECK(static_cast<double>(std::fabs(in_one_plane.gap_at_least)) <= static_cast<double>(kDepthTolerance));
}

// How far a point is at least outside a posed shape with an orthonormal rotation; 0 or less within. Hulls are left out.
Real outside(const JudgeShape& shape, const Point& p) {
  const Point from = p - shape.pose.at;
  Point q{};
  for (std::size_t k = 0; k < 3; ++k) q[k] = dot(from, to_vec3(shape.pose.column[k]));
  const Real* const s = shape.size;
  switch (shape.kind) {
    case JudgeKind::kBox: return std::max({std::fabs(q[0]) - s[0], std::fabs(q[1]) - s[1], std::fabs(q[2]) - s[2]});
    case JudgeKind::kSphere: return std::sqrt(dot(q, q)) - s[0];
    case JudgeKind::kEllipsoid: {
      const Point u = {{q[0] / s[0], q[1] / s[1], q[2] / s[2]}};
      return (std::sqrt(dot(u, u)) - 1) * std::min({s[0], s[1], s[2]});
    }
    case JudgeKind::kCapsule: {
      const Point r = {{q[0], q[1], q[2] - std::clamp(q[2], -s[1], s[1])}};
      return std::sqrt(dot(r, r)) - s[0];
    }
    case JudgeKind::kCylinder: return std::max(std::hypot(q[0], q[1]) - s[0], std::fabs(q[2]) - s[1]);
    default: return 0;
  }
}

JudgeShape random_shape(Random& random, double aspect) {
  JudgeShape out;
  constexpr JudgeKind kKinds[] = {JudgeKind::kBox, JudgeKind::kSphere, JudgeKind::kEllipsoid, JudgeKind::kCapsule,
                                  JudgeKind::kCylinder};
  out.kind = kKinds[static_cast<std::size_t>(random.uniform(0, 5)) % 5];
  for (Real& size : out.size) size = random.log_uniform(1 / aspect, 1);
  out.pose = random_pose(random, 2);
  return out;
}

TEST_CASE("every verdict carries its proof: points of both shapes, a common point, and a direction that parts them") {
  Random random(5);
  for (std::uint64_t round = 0; round < rounds(2000); ++round) {
    CAPTURE(round);
    const double aspect = round % 2 == 0 ? 3 : 1000;
    const JudgeShape a = random_shape(random, aspect), b = random_shape(random, aspect);
    for (const Effort effort : {Effort::kDecide, Effort::kMeasure}) {
      const Verdict verdict = judge(a, b, effort);
      CHECK(are_apart(verdict) != overlap(verdict));
      if (are_apart(verdict)) {
        CHECK(verdict.gap_at_least <= verdict.gap_at_most + kRounding);
        CHECK(outside(a, verdict.on_a) <= kPointTolerance);
        CHECK(outside(b, verdict.on_b) <= kPointTolerance);
        const Point between = verdict.on_b - verdict.on_a;
        const Real slack = verdict.gap_at_most - std::sqrt(dot(between, between));
        CHECK(slack >= -kRounding);
        CHECK(slack <= kDoubleSlack);
      } else {
        CHECK(outside(a, verdict.common) <= kPointTolerance);
        CHECK(outside(b, verdict.common) <= kPointTolerance);
      }
      // Moved along the normal by the depth and a little more, the shapes are apart.
      JudgeShape parted = b;
      parted.pose.at = b.pose.at + (Real{1e-12L} - std::fmin(verdict.gap_at_least, Real{0})) * verdict.normal;
      CHECK(are_apart(judge(a, parted, Effort::kDecide)));
      if (effort == Effort::kMeasure && are_apart(verdict))
        CHECK(static_cast<double>(verdict.gap_at_most - verdict.gap_at_least) <=
              static_cast<double>(kDistanceTolerance));
    }
  }
}

TEST_CASE("no direction of many parts shapes by less than their depth") {
  Random random(6);
  int deep = 0;
  for (std::uint64_t round = 0; round < rounds(100); ++round) {
    CAPTURE(round);
    JudgeShape a = random_shape(random, 4);
    const JudgeShape b = random_shape(random, 4);
    a.pose.at = b.pose.at + Real{0.2L} * a.pose.at;
    const Verdict verdict = judge(a, b, Effort::kMeasure);
    if (!overlap(verdict)) continue;
    ++deep;
    for (int i = 0; i < 300; ++i) {
      // Directions anywhere, and directions near the one found.
      const Vec3<double> any = random.unit_vector();
      const Point d =
          i % 3 == 0 ? convert<Real>(any) : verdict.normal + Real{i % 3 == 1 ? 1e-3L : 1e-7L} * convert<Real>(any);
      JudgeShape parted = b;
      parted.pose.at = b.pose.at - (verdict.gap_at_least + kSmoothDepthTolerance) / std::sqrt(dot(d, d)) * d;
      CHECK(overlap(judge(a, parted, Effort::kDecide)));
    }
  }
  CHECK(deep > 0);
}

TEST_CASE("the unit of length does not matter") {
  Random random(7);
  for (int round = 0; round < 20; ++round) {
    const JudgeShape a = random_shape(random, 10), b = random_shape(random, 10);
    const Verdict here = judge(a, b, Effort::kMeasure);
    for (const Real unit : {0x1p-40L, 0x1p40L}) {
      JudgeShape small_a = a, small_b = b;
      for (JudgeShape* const shape : {&small_a, &small_b}) {
        for (Real& size : shape->size) size *= unit;
        shape->pose.at = unit * shape->pose.at;
      }
      const Verdict there = judge(small_a, small_b, Effort::kMeasure);
      CHECK(are_apart(here) == are_apart(there));
      CHECK(static_cast<double>(std::fabs(there.gap_at_least / unit - here.gap_at_least)) <=
            static_cast<double>(kSmoothDepthTolerance));
    }
  }
}

}  // namespace
