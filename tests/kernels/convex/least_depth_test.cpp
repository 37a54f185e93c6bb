// The contact of hulls that lie face to face or edge to edge: many vertices are equally deep, and the points must still
// be in both bodies.
#include "kernels/float_mode.h"
#include "perf/judge/oracle/convex_faces.h"
#include "tests/kernels/convex/random_block.h"
#include "tests/kernels/isas.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <vector>

namespace {

using namespace cab;
using namespace cab::tests;
using oracle::Point;
using oracle::Real;

// The centres of hulls are kept in float, which moves points of size 1 by this much.
constexpr Real kCentre = 0x1p-23L;

// A prism or a tetrahedron of up to 2 * 8 vertices that stands on a face. Exact in float.
std::vector<float> standing(Random& random) {
  const std::uint32_t corners = 3 + random.index(6);
  const bool is_pointed = random.chance(0.3);
  std::vector<float> out;
  for (std::uint32_t i = 0; i < corners; ++i) {
    const double angle = 6.283185307179586 * (i + random.uniform(0, 0.8)) / corners, reach = random.uniform(0.4, 1);
    const auto x = static_cast<float>(reach * std::cos(angle)), y = static_cast<float>(reach * std::sin(angle));
    out.insert(out.end(), {x, y, -0.5f});
    if (!is_pointed) out.insert(out.end(), {x, y, 0.5f});
  }
  if (is_pointed) out.insert(out.end(), {0.0f, 0.0f, 1.5f});
  return out;
}

// A body: its vertices in the world, and the planes of its faces.
struct Solid {
  std::vector<Point> vertices;
  oracle::HullFaces faces;

  Solid(const std::vector<float>& local, const Point& at) {
    for (std::size_t v = 0; v < local.size(); v += 3)
      vertices.push_back(Point{{local[v], local[v + 1], local[v + 2]}} + at);
    faces = oracle::find_faces(vertices);
  }

  // How far a point is outside of some face's plane.
  Real outside(const Point& point) const {
    Real out = -10;
    for (const Point& normal : faces.normals) {
      Real top = -10;
      for (const Point& vertex : vertices) top = std::max(top, dot(normal, vertex));
      out = std::max(out, dot(normal, point) - top);
    }
    return out;
  }
};

}  // namespace

TEST_CASE("bodies that stand on each other touch at points of both, by every kernel with the same bits") {
  const kernel::FloatMode mode;
  std::uint64_t on_a_face = 0;
  for (std::uint64_t round = 0; round < rounds(600); ++round) {
    CAPTURE(round);
    const float deep = round % 2 ? 0x1p-4f : 0.0f;  // the upper one in the lower one, or just on it
    Random random(900 + round / 2);
    std::array<std::vector<float>, 2 * kLanes> vertices;
    std::vector<ConvexPart> parts;
    float poses[2 * kLanes][7];
    for (std::uint32_t i = 0; i < 2 * kLanes; ++i) {
      vertices[i] = standing(random);
      parts.push_back({ShapeKind::kConvexHull, {0, 0, 0}, {0, 0, 0, 1}, {0, 0, 0}, vertices[i]});
      const auto side = [&] { return static_cast<float>(random.uniform(-0.5, 0.5)); };
      const float pose[7] = {0, 0, 0, 1, side(), side(), i % 2 ? 1 - deep : 0.0f};
      std::copy_n(pose, 7, poses[i]);
    }
    ShapeBlock made(parts);
    for (std::uint32_t i = 0; i < kLanes; ++i) made.pose(i, poses[2 * i], poses[2 * i + 1]);
    kernel::ConvexContacts found;
    for (const kernel::KernelTable* kernels : available_kernels()) {
      kernel::ConvexContacts other;
      kernels->contact_pairs(made.block, other);
      if (kernels == available_kernels()[0]) found = other;
      CHECK(same_bits(found, other));
    }
    for (std::uint32_t i = 0; i < kLanes; ++i) {
      CAPTURE(i);
      const auto solid = [&](std::uint32_t s) { return Solid(vertices[s], {{poses[s][4], poses[s][5], poses[s][6]}}); };
      const Solid a = solid(2 * i), b = solid(2 * i + 1);
      const Point on_a = {{found.point_a[0][i], found.point_a[1][i], found.point_a[2][i]}},
                  on_b = {{found.point_b[0][i], found.point_b[1][i], found.point_b[2][i]}},
                  normal = {{found.normal[0][i], found.normal[1][i], found.normal[2][i]}};
      const Point off = (on_a - on_b) - Real{found.depth[i]} * normal;
      CHECK(dot(off, off) < kCentre * kCentre);
      if (found.depth[i] < 0) continue;  // beside each other: no more than near
      CHECK(a.outside(on_a) < kCentre);
      CHECK(b.outside(on_b) < kCentre);
      on_a_face += found.normal[2][i] > 0.999;
      if (found.normal[2][i] > 0.999) CHECK(std::fabs(found.depth[i] - deep) < 1e-6);
    }
  }
  CHECK(on_a_face * 4 >= rounds(600) * kLanes);
}

TEST_CASE("vertices in two planes with edges across give a contact of edges") {
  // Two wedges whose edges cross at right angles, 1/8 deep.
  const kernel::FloatMode mode;
  const std::vector<float> along_x = {-1, 0, 0, 1, 0, 0, -1, -1, -1, 1, -1, -1, -1, 1, -1, 1, 1, -1},
                           along_y = {0, -1, 0, 0, 1, 0, -1, -1, 1, -1, 1, 1, 1, -1, 1, 1, 1, 1};
  const std::vector<ConvexPart> parts = {{ShapeKind::kConvexHull, {0, 0, 0}, {0, 0, 0, 1}, {0, 0, 0}, along_x},
                                         {ShapeKind::kConvexHull, {0, 0, 0}, {0, 0, 0, 1}, {0, 0, 0}, along_y}};
  const float below[7] = {0, 0, 0, 1, 0, 0, 0}, above[7] = {0, 0, 0, 1, 0.25f, -0.5f, -0.125f};
  ShapeBlock made(parts);
  for (std::uint32_t i = 0; i < kLanes; ++i) made.pose(i, below, above);
  for (const kernel::KernelTable* kernels : available_kernels()) {
    kernel::ConvexContacts found;
    kernels->contact_pairs(made.block, found);
    CHECK(found.depth[0] == 0.125);
    CHECK(found.normal[2][0] == 1);
    const double right_a[3] = {0.25, 0, 0}, right_b[3] = {0.25, 0, -0.125};
    for (std::size_t c = 0; c < 3; ++c) {
      CHECK(found.point_a[c][0] == doctest::Approx(right_a[c]).epsilon(1e-12));
      CHECK(found.point_b[c][0] == doctest::Approx(right_b[c]).epsilon(1e-12));
    }
  }
}

TEST_CASE("the depth of needles is the least one, though their edges are short beside their distance") {
  // A needle of 32 vertices and a box of 8e-6 x 1e-5 x 0.6. Directions of edges as differences of posed vertices in
  // float had three digits here, and the depth was 200 times the least.
  const kernel::FloatMode mode;
  Random random(3175657);
  const RandomBlock made(random, ConvexRegime::kNeedles, ShapeKind::kConvexHull, ShapeKind::kBox);
  const Real least = -judge_case(made.cases[2], oracle::Effort::kMeasure).verdict.gap_at_most;
  CHECK(static_cast<double>(least) == doctest::Approx(5.14e-6).epsilon(1e-3));
  for (const kernel::KernelTable* kernels : available_kernels()) {
    kernel::ConvexContacts found;
    kernels->contact_pairs(made.block, found);
    CHECK(found.depth[2] < least + 1e-9L);
    CHECK(found.depth[2] > least - 1e-9L);
  }
}

TEST_CASE("the depth of hulls of many vertices, and of a capsule in one, is the least one") {
  const kernel::FloatMode mode;
  Random random(77);
  // The judge takes some seconds for a hull of so many vertices.
  const auto judged_lanes = static_cast<std::uint32_t>(std::max<std::uint64_t>(rounds(4), 1));
  for (const bool with_capsule : {false, true}) {
    RandomBlock made(random, ConvexRegime::kConcentric, ShapeKind::kConvexHull,
                     with_capsule ? ShapeKind::kCapsule : ShapeKind::kConvexHull);
    for (ConvexCase& one : made.cases) {
      for (oracle::PosedPart* posed : {&one.a, &one.b}) {
        if (posed->part.kind == ShapeKind::kConvexHull) {
          posed->vertices.clear();
          const std::uint32_t count = 70 + random.index(40);
          for (std::uint32_t v = 0; v < count; ++v) {
            const auto out = random.unit_vector();
            for (std::size_t c = 0; c < 3; ++c)
              posed->vertices.push_back(static_cast<float>(out[c] * (1.0 + 0.4 * static_cast<double>(c))));
          }
          for (float& size : posed->part.position) size = 0;
        } else {
          posed->part.size[0] = 0.2f;
          posed->part.size[1] = 0.4f;
        }
        for (std::size_t c = 0; c < 3; ++c) posed->pose[4 + c] = static_cast<float>(random.uniform(-0.4, 0.4));
      }
      for (double& by : one.shift) by = 0;
    }
    ShapeBlock large(perf::parts_of(made.cases));
    for (std::uint32_t i = 0; i < kLanes; ++i) {
      large.pose(i, made.cases[i].a.pose, made.cases[i].b.pose);
      REQUIRE(large.block.a.shape[i]->polytope);
    }
    kernel::ConvexContacts found;
    for (const kernel::KernelTable* kernels : available_kernels()) {
      kernel::ConvexContacts other;
      kernels->contact_pairs(large.block, other);
      if (kernels == available_kernels()[0]) found = other;
      CHECK(same_bits(found, other));
    }
    for (std::uint32_t i = 0; i < judged_lanes; ++i) {
      CAPTURE(with_capsule);
      CAPTURE(i);
      const Real least = -judge_case(made.cases[i], oracle::Effort::kMeasure).verdict.gap_at_most;
      CHECK(least > 0);
      CHECK(found.depth[i] <= least + 1e-9L);
      CHECK(found.depth[i] >= least - 1e-9L);
    }
  }
}

TEST_CASE("tilted stacks of prisms with many sides have least depths, and points that are as deep apart") {
  // Nearly all edges of both are near to parallel, or their arcs cross near to one direction.
  const kernel::FloatMode mode;
  Random random(5);
  for (std::uint64_t round = 0; round < rounds(8); ++round) {
    CAPTURE(round);
    const std::uint32_t sides = 8 + random.index(33);
    std::vector<float> vertices;
    for (std::uint32_t i = 0; i < 2 * sides; ++i) {
      const double angle = 6.283185307179586 * (i / 2) / sides;
      for (const double x : {std::cos(angle), std::sin(angle), i % 2 ? 0.5 : -0.5})
        vertices.push_back(static_cast<float>(x));
    }
    const std::vector<ConvexPart> parts = {{ShapeKind::kConvexHull, {0, 0, 0}, {0, 0, 0, 1}, {0, 0, 0}, vertices},
                                           {ShapeKind::kConvexHull, {0, 0, 0}, {0, 0, 0, 1}, {0, 0, 0}, vertices}};
    ShapeBlock made(parts);
    float poses[2][kLanes][7];
    for (std::uint32_t i = 0; i < kLanes; ++i) {
      const double tilt = random.log_uniform(1e-8, 1e-3), turn = i % 2 ? random.uniform(0, 3) : 0;
      const double q[4] = {tilt * random.normal(), tilt * random.normal(), std::sin(turn / 2), std::cos(turn / 2)};
      const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
      for (std::size_t c = 0; c < 7; ++c) {
        poses[0][i][c] = c == 3 ? 1.0f : 0.0f;
        poses[1][i][c] = static_cast<float>(c < 4 ? q[c] / length : c < 6 ? random.uniform(-1.3, 1.3) : 0.99);
      }
      made.pose(i, poses[0][i], poses[1][i]);
    }
    kernel::ConvexContacts found;
    for (const kernel::KernelTable* kernels : available_kernels()) {
      kernel::ConvexContacts other;
      kernels->contact_pairs(made.block, other);
      if (kernels == available_kernels()[0]) found = other;
      CHECK(same_bits(found, other));
    }
    for (std::uint32_t i = 0; i < kLanes; ++i) {
      CAPTURE(i);
      ConvexCase one = {};
      for (oracle::PosedPart* posed : {&one.a, &one.b}) {
        posed->part = parts[0];
        posed->vertices = vertices;
      }
      std::copy_n(poses[0][i], 7, one.a.pose);
      std::copy_n(poses[1][i], 7, one.b.pose);
      bind_vertices(one);
      const oracle::JudgedCase judged = judge_case(one, oracle::Effort::kMeasure);
      if (!(judged.verdict.gap_at_most < 0)) continue;
      CHECK(found.depth[i] <= -judged.verdict.gap_at_most + 1e-6L * judged.size);
      Point off = {};
      for (std::size_t c = 0; c < 3; ++c)
        off[c] = Real{found.point_a[c][i]} - found.point_b[c][i] - Real{found.depth[i]} * found.normal[c][i];
      CHECK(dot(off, off) < 1e-10L);
    }
  }
}

TEST_CASE("tiny hulls that are far from each other have the gap between them") {
  const kernel::FloatMode mode;
  const std::vector<float> vertices = {0, 0, 0, 1e-30f, 0, 0, 0, 1e-30f, 0, 0, 0, 1e-30f};
  const std::vector<ConvexPart> parts = {{ShapeKind::kConvexHull, {0, 0, 0}, {0, 0, 0, 1}, {0, 0, 0}, vertices},
                                         {ShapeKind::kConvexHull, {0, 0, 0}, {0, 0, 0, 1}, {0, 0, 0}, vertices}};
  const float here[7] = {0, 0, 0, 1, 0, 0, 0}, there[7] = {0, 0, 0, 1, 1e10f, 0, 0};
  ShapeBlock made(parts);
  for (std::uint32_t i = 0; i < kLanes; ++i) made.pose(i, here, there);
  for (const kernel::KernelTable* kernels : available_kernels()) {
    kernel::ConvexContacts found;
    kernels->contact_pairs(made.block, found);
    CHECK(found.depth[0] == doctest::Approx(-1e10));
    CHECK(found.normal[0][0] == doctest::Approx(1));
  }
}
