// The convex parts of a leaf that an articulation accepts: their sizes and rotations, and that they lie in the leaf's
// box.
#include "layout/arena.h"
#include "layout/articulation.h"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace {

using namespace cab;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr std::uint32_t kUntouched = 77777;

struct Answer {
  Status status;
  std::uint32_t bad_element;
};

// Two leaves with half extents 3 2 1 and centre (5, 0, 0). The second has the given parts.
Answer add_parts(Span<const ConvexPart> parts) {
  const Box box = {{5, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {3, 2, 1}};
  const std::int32_t parents[] = {-1, 0};
  const Leaf leaves[] = {{0, box, {}}, {1, box, parts}};
  Arena arena(default_allocator());
  Articulation out;
  Answer answer = {Status::kOk, kUntouched};
  answer.status = build_articulation({{parents, 2}, {}, {leaves, 2}, {}}, arena, &out, &answer.bad_element);
  return answer;
}

Answer add_part(const ConvexPart& part) { return add_parts({&part, 1}); }

bool accepted(const ConvexPart& part) {
  const Answer answer = add_part(part);
  CHECK(answer.bad_element == (answer.status == Status::kOk ? kUntouched : 1));
  CHECK((answer.status == Status::kOk || answer.status == Status::kShapeOutsideLeafBox));
  return answer.status == Status::kOk;
}

bool malformed(const ConvexPart& part) {
  const Answer answer = add_part(part);
  return answer.status == Status::kBadShape && answer.bad_element == 1;
}

ConvexPart part_at(ShapeKind kind, float x, float y, float z, float size_0, float size_1, float size_2) {
  ConvexPart part;
  part.kind = kind;
  part.position[0] = x;
  part.position[1] = y;
  part.position[2] = z;
  part.size[0] = size_0;
  part.size[1] = size_1;
  part.size[2] = size_2;
  return part;
}

// A rotation by an angle about a coordinate axis.
void turn(ConvexPart& part, int axis, double angle) {
  for (float& v : part.rotation) v = 0;
  part.rotation[axis] = static_cast<float>(std::sin(angle / 2));
  part.rotation[3] = static_cast<float>(std::cos(angle / 2));
}

constexpr double kRightAngle = 1.5707963267948966;

}  // namespace

TEST_CASE("a box part may fill its leaf's box and not stick out of any of its faces") {
  CHECK(accepted(part_at(ShapeKind::kBox, 5, 0, 0, 3, 2, 1)));
  CHECK(accepted(part_at(ShapeKind::kBox, 7, 1, -0.5f, 1, 1, 0.5f)));
  for (int c = 0; c < 3; ++c) {
    for (const float step : {-0.001f, 0.001f}) {
      CAPTURE(c);
      ConvexPart part = part_at(ShapeKind::kBox, 5, 0, 0, 3, 2, 1);
      part.position[c] += step;
      CHECK_FALSE(accepted(part));
    }
    ConvexPart part = part_at(ShapeKind::kBox, 5, 0, 0, 3, 2, 1);
    part.size[c] *= 1.001f;
    CHECK_FALSE(accepted(part));
  }
  ConvexPart rotated = part_at(ShapeKind::kBox, 5, 0, 0, 2, 3, 1);
  CHECK_FALSE(accepted(rotated));
  turn(rotated, 2, kRightAngle);
  CHECK(accepted(rotated));
}

TEST_CASE("a part may exceed its leaf's box by the rounding of a float fit and no more") {
  ConvexPart part = part_at(ShapeKind::kBox, 5, 0, 0, std::nextafter(3.0f, 4.0f), 2, 1);
  CHECK(accepted(part));
  part.size[0] = 3 + 6 * 0x1p-21f;
  CHECK_FALSE(accepted(part));
}

TEST_CASE("an ellipsoid may touch the faces of its leaf's box from inside, rotated or not") {
  CHECK(accepted(part_at(ShapeKind::kEllipsoid, 5, 0, 0, 3, 2, 1)));
  CHECK_FALSE(accepted(part_at(ShapeKind::kEllipsoid, 5, 0, 0, 3.001f, 2, 1)));
  CHECK_FALSE(accepted(part_at(ShapeKind::kEllipsoid, 5, 0, 0.001f, 3, 2, 1)));
  // Rotated by 45 degrees about z it reaches sqrt((3^2 + 1^2) / 2) = 2.236 along x and y, more than a box of half 2.
  ConvexPart rotated = part_at(ShapeKind::kEllipsoid, 5, 0, 0, 3, 1, 1);
  turn(rotated, 2, kRightAngle / 2);
  CHECK_FALSE(accepted(rotated));
  // With radii 2.5 and 1 it reaches 1.904, although its corners' box reaches 2.475.
  rotated = part_at(ShapeKind::kEllipsoid, 5, 0, 0, 2.5f, 1, 1);
  turn(rotated, 2, kRightAngle / 2);
  CHECK(accepted(rotated));
}

TEST_CASE("a capsule lies along its own z and reaches half its length plus its radius") {
  ConvexPart capsule = part_at(ShapeKind::kCapsule, 5, 0, 0, 1, 2, 0);
  CHECK_FALSE(accepted(capsule));  // 3 along z
  turn(capsule, 1, kRightAngle);
  CHECK(accepted(capsule));  // 3 along x
  capsule.size[1] = 2.001f;
  CHECK_FALSE(accepted(capsule));
  capsule.size[1] = 2;
  capsule.size[0] = 1.001f;
  CHECK_FALSE(accepted(capsule));
  capsule.size[0] = 1;
  turn(capsule, 0, kRightAngle);
  CHECK_FALSE(accepted(capsule));  // 3 along y
  capsule.size[1] = 1;
  CHECK(accepted(capsule));
}

TEST_CASE("a sphere reaches its radius, a cylinder the rims of its ends") {
  CHECK(accepted(part_at(ShapeKind::kSphere, 5, 1, 0, 1, 0, 0)));
  CHECK_FALSE(accepted(part_at(ShapeKind::kSphere, 5, 1, 0, 1.001f, 0, 0)));
  CHECK_FALSE(accepted(part_at(ShapeKind::kSphere, 5, 1.001f, 0, 1, 0, 0)));
  ConvexPart cylinder = part_at(ShapeKind::kCylinder, 5, 0, 0, 2, 1, 0);
  CHECK(accepted(cylinder));  // 2 along x and y, 1 along z
  cylinder.size[1] = 1.001f;
  CHECK_FALSE(accepted(cylinder));
  cylinder.size[1] = 1;
  cylinder.size[0] = 2.001f;
  CHECK_FALSE(accepted(cylinder));
  // Turned by 45 degrees about x it reaches (size 0 + size 1) / sqrt 2 along y and z.
  cylinder.size[0] = 0.9f;
  cylinder.size[1] = 0.514f;
  turn(cylinder, 0, kRightAngle / 2);
  CHECK(accepted(cylinder));
  cylinder.size[1] = 0.515f;
  CHECK_FALSE(accepted(cylinder));
}

TEST_CASE("of a half space the position must lie in the leaf's box, whichever way it faces") {
  ConvexPart floor = part_at(ShapeKind::kHalfSpace, 8, -2, 1, 0, 0, 0);
  CHECK(accepted(floor));
  turn(floor, 0, kRightAngle / 3);
  CHECK(accepted(floor));
  for (int c = 0; c < 3; ++c) {
    ConvexPart outside = floor;
    outside.position[c] *= 1.001f;
    CHECK_FALSE(accepted(outside));
  }
}

TEST_CASE("AABB+ takes the corners of the box about a part, and of the leaf's box for a half space") {
  // A rotation by 90 degrees about x takes y to z and z to -y.
  ConvexPart parts[3];
  parts[0] = part_at(ShapeKind::kSphere, 5, 0, 0, 0.5f, 7, 7);
  parts[1] = part_at(ShapeKind::kCylinder, 5, 0, 0, 0.5f, 1.5f, 7);
  turn(parts[1], 0, kRightAngle);
  parts[2] = part_at(ShapeKind::kHalfSpace, 5, 0, 0, 7, 7, 7);
  constexpr double kExtents[][3] = {{0.5, 0.5, 0.5}, {0.5, 1.5, 0.5}, {3, 2, 1}};
  for (std::size_t p = 0; p < 3; ++p) {
    CAPTURE(p);
    const Box box = {{5, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {3, 2, 1}};
    const std::int32_t parent = -1;
    const Leaf leaf = {0, box, {&parts[p], 1}};
    Arena arena(default_allocator());
    Articulation out;
    REQUIRE(build_articulation({{&parent, 1}, {}, {&leaf, 1}, {}}, arena, &out, nullptr) == Status::kOk);
    REQUIRE(out.vertices.size == 24);
    for (std::size_t v = 0; v < 24; ++v) {
      const double from_center = static_cast<double>(out.vertices[v]) - (v % 3 == 0 ? 5 : 0);
      CHECK(std::fabs(from_center) == doctest::Approx(kExtents[p][v % 3]));
    }
  }
}

TEST_CASE("a hull is inside when every vertex is, wherever the part stands") {
  std::vector<float> vertices = {-3, -2, -1, 3, -2, -1, 0, 2, -1, 0, 0, 1};
  ConvexPart hull = part_at(ShapeKind::kConvexHull, 5, 0, 0, 0, 0, 0);
  hull.vertices = vertices;
  CHECK(accepted(hull));
  hull.position[0] = 5.001f;
  CHECK_FALSE(accepted(hull));
  hull.position[0] = 5;
  vertices[11] = 1.001f;
  CHECK_FALSE(accepted(hull));
  vertices[11] = 1;
  turn(hull, 2, 2 * kRightAngle);
  CHECK(accepted(hull));
  turn(hull, 2, kRightAngle);
  CHECK_FALSE(accepted(hull));
}

TEST_CASE("every part of a list is judged") {
  ConvexPart parts[3];
  for (ConvexPart& part : parts) part = part_at(ShapeKind::kBox, 5, 0, 0, 1, 1, 1);
  CHECK(add_parts({parts, 3}).status == Status::kOk);
  parts[2].position[0] = 9;
  CHECK(add_parts({parts, 3}).status == Status::kShapeOutsideLeafBox);
  parts[1].size[0] = 0;
  CHECK(add_parts({parts, 3}).status == Status::kBadShape);
  CHECK(add_parts({nullptr, 3}).status == Status::kBadShape);
  CHECK(add_parts({nullptr, 3}).bad_element == 1);
}

TEST_CASE("sizes must be positive, finite and within range, and only those that the kind uses are read") {
  for (const float bad : {0.0f, -0.5f, kNan, std::numeric_limits<float>::infinity(), 2 * kMaxCoordinate}) {
    for (int i = 0; i < 3; ++i) {
      CAPTURE(bad);
      CAPTURE(i);
      static constexpr std::pair<ShapeKind, int> kSizes[] = {{ShapeKind::kBox, 3},      {ShapeKind::kEllipsoid, 3},
                                                             {ShapeKind::kCapsule, 2},  {ShapeKind::kSphere, 1},
                                                             {ShapeKind::kCylinder, 2}, {ShapeKind::kHalfSpace, 0}};
      for (const auto& row : kSizes) {
        ConvexPart part = part_at(row.first, 5, 0, 0, 0.5f, 0.5f, 0.5f);
        part.size[i] = bad;
        CAPTURE(static_cast<int>(row.first));
        if (i < row.second)
          CHECK(malformed(part));
        else
          CHECK(accepted(part));
      }
    }
  }
}

TEST_CASE("a part's place must be finite and its rotation a unit quaternion to 1e-3") {
  const auto spoilt = [](auto&& spoil) {
    ConvexPart part = part_at(ShapeKind::kBox, 5, 0, 0, 0.5f, 0.5f, 0.5f);
    spoil(part);
    return malformed(part);
  };
  CHECK_FALSE(spoilt([](ConvexPart&) {}));
  CHECK(spoilt([](ConvexPart& part) { part.position[1] = kNan; }));
  CHECK(spoilt([](ConvexPart& part) { part.position[1] = 2 * kMaxCoordinate; }));
  CHECK(spoilt([](ConvexPart& part) { part.rotation[3] = 0; }));
  CHECK(spoilt([](ConvexPart& part) { part.rotation[0] = kNan; }));
  CHECK(spoilt([](ConvexPart& part) { part.rotation[3] = 1.01f; }));
  CHECK_FALSE(spoilt([](ConvexPart& part) { part.rotation[3] = 1.0001f; }));
  CHECK(spoilt([](ConvexPart& part) { part.kind = static_cast<ShapeKind>(7); }));
}

TEST_CASE("a hull needs at least three finite vertices of three coordinates") {
  std::vector<float> vertices = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  ConvexPart hull = part_at(ShapeKind::kConvexHull, 5, 0, 0, 0, 0, 0);
  CHECK(malformed(hull));
  hull.vertices = {vertices.data(), 9};
  CHECK(accepted(hull));
  hull.vertices = {vertices.data(), 6};
  CHECK(malformed(hull));
  hull.vertices = {vertices.data(), 11};
  CHECK(malformed(hull));
  hull.vertices = {nullptr, 12};
  CHECK(malformed(hull));
  hull.vertices = {vertices.data(), 12};
  CHECK(accepted(hull));
  vertices[7] = kNan;
  CHECK(malformed(hull));
}

TEST_CASE("a hull may be flat but not lie on one line, in any unit of length and anywhere in its link") {
  const auto hull_takes = [](float unit, float height, float shift) {
    std::vector<float> vertices = {0.25f, 0, 0, 0, 0, 0, 1, 0, 0, 0.5f, 0, height};
    for (float& v : vertices) v = unit * (v + shift);
    const Box box = {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {unit * 16, unit * 16, unit * 16}};
    ConvexPart hull;
    hull.kind = ShapeKind::kConvexHull;
    hull.vertices = vertices;
    const std::int32_t parent = -1;
    const Leaf leaf = {0, box, {&hull, 1}};
    Arena arena(default_allocator());
    Articulation out;
    const Status status = build_articulation({{&parent, 1}, {}, {&leaf, 1}, {}}, arena, &out, nullptr);
    CHECK((status == Status::kOk || status == Status::kBadShape));
    return status == Status::kOk;
  };
  for (const float unit : {1e-30f, 1e-12f, 1e-3f, 1.0f, 1e16f}) {
    CAPTURE(unit);
    CHECK(hull_takes(unit, 1, 0));
    CHECK(hull_takes(unit, 1, 8));
    CHECK(hull_takes(unit, 1e-6f, 0));
    CHECK_FALSE(hull_takes(unit, 0, 0));
    CHECK_FALSE(hull_takes(unit, 0, 8));
    CHECK_FALSE(hull_takes(unit, 0x1p-47f, 0));
    CHECK(hull_takes(unit, 0x1p-45f, 0));
  }
}
