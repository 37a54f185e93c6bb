// Exact tests: yes and no against answers worked out by hand, contacts by FCL, and its counts.
#include "perf/harness/random_world.h"

#include <doctest/doctest.h>

#include <sys/resource.h>

#include <array>
#include <cmath>
#include <cstring>

namespace {

using namespace cab;
using namespace cab::oracle;

constexpr Policies kExactTree = {Refit::kCab, Strategy::kTree, Exact::kFcl};
constexpr double kPi = 3.14159265358979323846;

// Tolerances of the normal and depth of FCL's contacts against answers worked out by hand. The comment behind each is
// the worst measured difference.
constexpr double kBoxTolerance = 1e-7;        // 6.0e-9
constexpr double kEllipsoidTolerance = 1e-6;  // 2.4e-8

ConvexPart shape(ShapeKind kind, float a, float b, float c) {
  ConvexPart part;
  part.kind = kind;
  part.size[0] = a;
  part.size[1] = b;
  part.size[2] = c;
  return part;
}

ConvexPart moved(ConvexPart part, float x, float y, float z) {
  part.position[0] = x;
  part.position[1] = y;
  part.position[2] = z;
  return part;
}

ConvexPart hull_of(const std::vector<float>& vertices) {
  ConvexPart part;
  part.kind = ShapeKind::kConvexHull;
  part.vertices = vertices;
  return part;
}

// A link with one leaf of half extent 3 and the given parts.
Rig body(Span<const ConvexPart> parts) {
  Rig rig;
  rig.parents = {-1};
  rig.leaves = {{0, {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {3, 3, 3}}, parts}};
  return rig;
}

// Where the second body is: rotated about z by an angle, then moved. A caller can say this in several ways.
struct Place {
  double x, y, z, angle = 0;
};

Poses poses_at(const Place& at, PoseFormat format, bool by_origin, bool by_orientation) {
  Poses poses;
  poses.format = format;
  poses.link_count = poses.instance_count = 1;
  poses.data.resize(poses.floats_per_pose());
  double q[4], none[4];
  quaternion_about({{0, 0, 1}}, at.angle, q);
  quaternion_about({{0, 0, 1}}, 0, none);
  const oracle::Vec3<double> t = {{at.x, at.y, at.z}};
  write_pose(format, by_orientation ? none : q, by_origin ? oracle::Vec3<double>{} : t, poses.data.data());
  if (by_origin) poses.origins = {t[0] + 1e8, t[1], t[2]};
  if (by_orientation)
    for (const double v : q) poses.orientations.push_back(static_cast<float>(v));
  return poses;
}

// Whether two bodies touch. The answer must be the same for every way to place them, as characters and as sequences, by
// either test.
bool touch(Span<const ConvexPart> a, Span<const ConvexPart> b, const Place& at) {
  int yes = 0, asked = 0;
  for (const PoseFormat format :
       {PoseFormat::kQuaternionTranslation, PoseFormat::kMatrix3x4Rows, PoseFormat::kMatrix4x4Columns}) {
    for (const BatchKind kind : {BatchKind::kCharacters, BatchKind::kSequence}) {
      for (const bool by_origin : {false, true}) {
        World world;
        world.members.push_back({body(a), poses_at({0, 0, 0}, format, by_origin, false), kind});
        world.members.push_back({body(b), poses_at(at, format, by_origin, by_origin), kind});
        world.rules = {{{1}, {2}, Pairing::kBetween}};
        for (const Exact exact : {Exact::kFcl, Exact::kConvex}) {
          const Strategy strategy = asked / 2 % 2 ? Strategy::kTree : Strategy::kBrute;
          const Outcome outcome = run_world(world, {Refit::kCab, strategy, exact});
          CHECK(outcome.stats.exact_tests == outcome.stats.leaf_pairs);
          CHECK(outcome.hits.size() == outcome.stats.exact_tests - outcome.stats.false_positives);
          yes += outcome.hits.size() == 1;
          ++asked;
        }
      }
    }
  }
  CHECK((yes == 0 || yes == asked));
  return yes > 0;
}

bool touch(const ConvexPart& a, const ConvexPart& b, const Place& at) { return touch({&a, 1}, {&b, 1}, at); }

}  // namespace

TEST_CASE("spheres touch when their centres are nearer than their radii together") {
  const ConvexPart small = shape(ShapeKind::kEllipsoid, 1, 1, 1), large = shape(ShapeKind::kEllipsoid, 2, 2, 2);
  for (double angle = 0; angle < 6; angle += 0.7) {
    CAPTURE(angle);
    const double x = std::cos(angle) * 0.8, y = std::sin(angle) * 0.8, z = 0.6;
    CHECK(touch(small, large, {2.99 * x, 2.99 * y, 2.99 * z}));
    CHECK_FALSE(touch(small, large, {3.01 * x, 3.01 * y, 3.01 * z}));
  }
  CHECK(touch(small, large, {0, 0, 0}));
}

TEST_CASE("an ellipsoid touches by its own radius in each direction") {
  const ConvexPart egg = shape(ShapeKind::kEllipsoid, 2, 1, 0.5f), ball = shape(ShapeKind::kEllipsoid, 1, 1, 1);
  CHECK(touch(ball, egg, {2.99, 0, 0}));
  CHECK_FALSE(touch(ball, egg, {3.01, 0, 0}));
  CHECK_FALSE(touch(ball, egg, {0, 2.01, 0}));
  CHECK(touch(ball, egg, {0, 1.99, 0}));
  CHECK_FALSE(touch(ball, egg, {0, 0, 1.51}));
  CHECK(touch(ball, egg, {0, 2.99, 0, kPi / 2}));  // rotated, its long axis lies along y
  CHECK_FALSE(touch(ball, egg, {2.01, 0, 0, kPi / 2}));
}

TEST_CASE("a sphere touches as an ellipsoid of equal radii does") {
  const ConvexPart ball = shape(ShapeKind::kSphere, 1, 0, 0), large = shape(ShapeKind::kSphere, 2, 0, 0),
                   cube = shape(ShapeKind::kBox, 1, 1, 1);
  for (double angle = 0; angle < 6; angle += 0.7) {
    CAPTURE(angle);
    const double x = std::cos(angle) * 0.8, y = std::sin(angle) * 0.8, z = 0.6;
    CHECK(touch(ball, large, {2.99 * x, 2.99 * y, 2.99 * z}));
    CHECK_FALSE(touch(ball, large, {3.01 * x, 3.01 * y, 3.01 * z}));
  }
  CHECK(touch(ball, cube, {1.99, 0, 0}));
  CHECK_FALSE(touch(ball, cube, {2.01, 0, 0}));
  CHECK_FALSE(touch(cube, ball, {0, 0, -2.01}));
}

TEST_CASE("a cylinder has a round side, flat ends and sharp rims") {
  const ConvexPart can = shape(ShapeKind::kCylinder, 1, 0.5f, 0), ball = shape(ShapeKind::kSphere, 0.5f, 0, 0),
                   cube = shape(ShapeKind::kBox, 1, 1, 1);
  const double diagonal = std::sqrt(0.5);
  CHECK(touch(can, ball, {1.49 * diagonal, 1.49 * diagonal, 0}));
  CHECK_FALSE(touch(can, ball, {1.51 * diagonal, 1.51 * diagonal, 0}));
  CHECK(touch(can, ball, {0.9, 0, 0.99}));
  CHECK_FALSE(touch(can, ball, {0.9, 0, 1.01}));
  CHECK(touch(can, ball, {1 + 0.49 * diagonal, 0, 0.5 + 0.49 * diagonal}));  // at the rim
  CHECK_FALSE(touch(can, ball, {1 + 0.51 * diagonal, 0, 0.5 + 0.51 * diagonal}));
  CHECK(touch(can, cube, {0, 1.99, 0, kPi / 2}));
  CHECK_FALSE(touch(can, cube, {0, 2.01, 0, kPi / 2}));
  CHECK(touch(can, can, {1.4, 1.4, 0.99}));
  CHECK_FALSE(touch(can, can, {1.42, 1.42, 0.99}));
  CHECK_FALSE(touch(can, can, {1.4, 1.4, 1.01}));
}

TEST_CASE("a triangle and a polygon have no thickness") {
  const std::vector<float> triangle = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  const std::vector<float> square = {1, 1, 0, 1, -1, 0, -1, -1, 0, -1, 1, 0, 0.2f, 0.1f, 0};
  const ConvexPart corner = hull_of(triangle), sheet = hull_of(square), ball = shape(ShapeKind::kSphere, 0.5f, 0, 0),
                   cube = shape(ShapeKind::kBox, 1, 1, 1);
  CHECK(touch(sheet, ball, {0.9, 0.9, 0.49}));
  CHECK_FALSE(touch(sheet, ball, {0.9, 0.9, 0.51}));
  CHECK(touch(sheet, ball, {1.49, 0, 0}));
  CHECK_FALSE(touch(sheet, ball, {1.51, 0, 0}));
  CHECK(touch(corner, ball, {0.5 + 0.49 * std::sqrt(0.5), 0.5 + 0.49 * std::sqrt(0.5), 0}));
  CHECK_FALSE(touch(corner, ball, {0.5 + 0.51 * std::sqrt(0.5), 0.5 + 0.51 * std::sqrt(0.5), 0}));
  CHECK(touch(corner, cube, {1.99, 0, 0.99}));
  CHECK_FALSE(touch(corner, cube, {1.99, 0, 1.01}));
  CHECK_FALSE(touch(corner, cube, {2.01, 0, 0}));
  CHECK(touch(corner, sheet, {1.5, 0, 0}));  // in one plane
  CHECK_FALSE(touch(corner, sheet, {2.01, 0, 0}));
  CHECK_FALSE(touch(corner, sheet, {0, 0, 0.01}));
}

TEST_CASE("a half space fills its side of a plane without end") {
  ConvexPart floor = shape(ShapeKind::kHalfSpace, 0, 0, 0);
  const ConvexPart cube = shape(ShapeKind::kBox, 1, 1, 1), can = shape(ShapeKind::kCylinder, 1, 0.5f, 0),
                   egg = shape(ShapeKind::kEllipsoid, 2, 1, 0.5f), ball = shape(ShapeKind::kSphere, 0.5f, 0, 0);
  const std::vector<float> vertices = {0, 0, 0.25f, 1, 0, 0.25f, 0, 1, 0.25f};
  const ConvexPart triangle = hull_of(vertices);
  for (const double x : {0.0, 3.5, -3.5}) {
    CAPTURE(x);
    CHECK(touch(floor, cube, {x, 1, 0.99}));
    CHECK_FALSE(touch(floor, cube, {x, 1, 1.01}));
    CHECK(touch(floor, cube, {x, 1, -3}));
    CHECK(touch(floor, can, {x, 1, 0.49}));
    CHECK_FALSE(touch(floor, can, {x, 1, 0.51}));
    CHECK_FALSE(touch(floor, egg, {x, 1, 0.51}));
    CHECK(touch(egg, floor, {x, 1, -0.49}));
    CHECK_FALSE(touch(egg, floor, {x, 1, -0.51}));
    CHECK(touch(floor, ball, {x, 1, 0.49}));
    CHECK_FALSE(touch(floor, ball, {x, 1, 0.51}));
    CHECK(touch(floor, triangle, {x, 1, -0.26}));
    CHECK_FALSE(touch(floor, triangle, {x, 1, -0.24}));
    CHECK(touch(floor, floor, {x, 1, 1}));
  }
  // A wall whose normal is x.
  floor.rotation[1] = floor.rotation[3] = static_cast<float>(std::sqrt(0.5));
  CHECK(touch(floor, cube, {0.99, 0, 0}));
  CHECK_FALSE(touch(floor, cube, {1.01, 0, 0}));
  CHECK(touch(floor, cube, {1.41, 0, 0, kPi / 4}));
  CHECK_FALSE(touch(floor, cube, {1.42, 0, 0, kPi / 4}));
}

TEST_CASE("boxes touch by face, edge and corner") {
  const ConvexPart cube = shape(ShapeKind::kBox, 1, 1, 1);
  CHECK(touch(cube, cube, {1.999, 1.999, 1.999}));
  CHECK_FALSE(touch(cube, cube, {2.001, 0, 0}));
  CHECK_FALSE(touch(cube, cube, {0, 0, -2.001}));
  CHECK(touch(cube, cube, {1 + std::sqrt(2.0) - 0.001, 0, 0, kPi / 4}));  // an edge against a face
  CHECK_FALSE(touch(cube, cube, {1 + std::sqrt(2.0) + 0.001, 0, 0, kPi / 4}));
}

TEST_CASE("capsules are as long as said along z, and round") {
  const ConvexPart capsule = shape(ShapeKind::kCapsule, 0.5f, 1, 0),
                   ball = shape(ShapeKind::kEllipsoid, 0.5f, 0.5f, 0.5f);
  CHECK(touch(capsule, ball, {0, 0, 1.99}));  // 1 + 0.5 + 0.5
  CHECK_FALSE(touch(capsule, ball, {0, 0, 2.01}));
  CHECK(touch(capsule, ball, {0.99, 0, 0.9}));
  CHECK_FALSE(touch(capsule, ball, {1.01, 0, 0.9}));
  CHECK_FALSE(touch(capsule, ball, {0.75, 0, 1.75}));  // beyond the cap: 1.06 from its centre
  CHECK(touch(capsule, ball, {0.65, 0, 1.65}));        // 0.92
}

TEST_CASE("hulls touch where their faces are, not their boxes") {
  const std::vector<float> vertices = {1, 0, 0, -1, 0, 0, 0,  1,    0,    0,   -1,
                                       0, 0, 0, 1,  0, 0, -1, 0.1f, 0.1f, 0.1f};  // an octahedron and a point inside
  const ConvexPart hull = hull_of(vertices), ball = shape(ShapeKind::kEllipsoid, 0.5f, 0.5f, 0.5f);
  CHECK(touch(hull, ball, {1.49, 0, 0}));
  CHECK_FALSE(touch(hull, ball, {1.51, 0, 0}));
  const double face = 1 / std::sqrt(3.0), in = (face + 0.49) * face, out = (face + 0.51) * face;
  CHECK(touch(hull, ball, {in, in, in}));
  CHECK_FALSE(touch(hull, ball, {out, out, out}));
  CHECK(touch(hull, hull, {1.99, 0, 0}));
  CHECK_FALSE(touch(hull, hull, {1.01, 1.01, 0}));
}

TEST_CASE("a list of parts touches where any of them does, each at its own place") {
  ConvexPart rotated = moved(shape(ShapeKind::kBox, 1.5f, 0.2f, 0.2f), 0, 0, -1);
  rotated.rotation[2] = rotated.rotation[3] = static_cast<float>(std::sqrt(0.5));  // along y
  const ConvexPart dumbbell[] = {moved(shape(ShapeKind::kEllipsoid, 0.5f, 0.5f, 0.5f), 2, 0, 0),
                                 moved(shape(ShapeKind::kBox, 0.5f, 0.5f, 0.5f), -2, 0, 0), rotated};
  const ConvexPart ball = shape(ShapeKind::kEllipsoid, 0.4f, 0.4f, 0.4f);
  const auto touches_at = [&](double x, double y, double z) { return touch({dumbbell, 3}, {&ball, 1}, {x, y, z}); };
  CHECK_FALSE(touches_at(0, 0, 0));
  CHECK(touches_at(2.89, 0, 0));
  CHECK_FALSE(touches_at(2.91, 0, 0));
  CHECK_FALSE(touches_at(2.7, 0.7, 0));  // the sphere's corner is empty
  CHECK(touches_at(-2.7, 0.7, 0));       // the box's is not
  CHECK(touches_at(0, 1.8, -1));
  CHECK_FALSE(touches_at(1, 0, -1));
  CHECK(touch({&ball, 1}, {dumbbell, 3}, {-1.2, 0, 0}));
}

TEST_CASE("a leaf without parts is its box, plates and points included") {
  const ConvexPart ball = shape(ShapeKind::kEllipsoid, 1, 1, 1);
  CHECK(touch({}, {&ball, 1}, {3.99, 0, 0}));
  CHECK_FALSE(touch({}, {&ball, 1}, {3.8, 3.8, 0}));
  World world;
  world.members.push_back(
      {body({}), poses_at({0, 0, 0}, PoseFormat::kMatrix3x4Rows, false, false), BatchKind::kCharacters});
  world.members.push_back(
      {body({}), poses_at({3.5, 0, 0}, PoseFormat::kMatrix3x4Rows, false, false), BatchKind::kCharacters});
  world.rules = {{{1}, {2}, Pairing::kBetween}};
  for (int flat = 1; flat <= 3; ++flat) {
    CAPTURE(flat);
    for (int k = 0; k < flat; ++k) world.members[1].rig.leaves[0].box.half[k] = 0;
    CHECK(run_world(world, kExactTree).hits.size() == 0);
    world.members[1].poses = poses_at({1, 0.5, 0.25}, PoseFormat::kMatrix3x4Rows, false, false);
    CHECK(run_world(world, kExactTree).hits.size() == 1);
    world.members[1].poses = poses_at({3.5, 0, 0}, PoseFormat::kMatrix3x4Rows, false, false);
  }
}

TEST_CASE("a leaf that is a plate, a segment or a point touches a triangle in its plane") {
  const std::vector<float> vertices = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  const ConvexPart triangle = hull_of(vertices);
  World world;
  world.members.push_back({body({&triangle, 1}), {}, BatchKind::kCharacters});
  world.members.push_back({body({}), {}, BatchKind::kCharacters});
  world.rules = {{{1}, {2}, Pairing::kBetween}};
  float(&half)[3] = world.members[1].rig.leaves[0].box.half;
  const auto hits_at = [&](const Place& at, Exact exact) {
    world.members[0].poses = poses_at({0, 0, 0, at.angle}, PoseFormat::kMatrix3x4Rows, false, false);
    world.members[1].poses = poses_at(at, PoseFormat::kMatrix3x4Rows, false, false);
    return run_world(world, {Refit::kCab, Strategy::kTree, exact}).hits.size();
  };
  const float sizes[][3] = {{1, 1, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 0}, {1, 1, 1e-8f}};
  for (const auto& size : sizes) {
    std::copy_n(size, 3, half);
    for (const Exact exact : {Exact::kFcl, Exact::kConvex}) {
      CAPTURE(size);
      CAPTURE(static_cast<int>(exact));
      CHECK(hits_at({0.2, 0.2, 0}, exact) == 1);
      CHECK(hits_at({0.1, 0.3, 0, 0.4}, exact) == 1);
      CHECK(hits_at({2.01, 0, 0}, exact) == 0);
      CHECK(hits_at({0.2, 0.2, 0.01}, exact) == 0);
    }
  }
}

TEST_CASE("a hull whose vertices have no area is refused with its leaf") {
  const std::vector<float> two = {0, 0, 0, 1, 0, 0};
  const std::vector<float> line = {0, 0, 0, 1, 1, 1, 2, 2, 2, -1, -1, -1};
  const std::vector<float> point(12, 0.5f);
  const std::vector<float> solid = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  for (const auto* const vertices : {&two, &line, &point}) {
    const ConvexPart good = hull_of(solid), bad = hull_of(*vertices);
    Rig rig = body({&good, 1});
    rig.leaves.push_back(rig.leaves[0]);
    rig.leaves.push_back(rig.leaves[0]);
    rig.leaves[2].parts = {&bad, 1};
    const EnginePtr engine = make_engine();
    ArticulationId id = {42};
    std::uint32_t element = 42;
    CHECK(add_articulation(*engine, rig.desc(), &id, &element) == Status::kBadShape);
    CHECK(element == 2);
    CHECK(id.value == 42);
    rig.leaves.pop_back();
    CHECK(add_articulation(*engine, rig.desc(), &id, &element) == Status::kOk);
  }
}

namespace {

// The contact of two bodies that have exactly one.
Contact contact_of(const ConvexPart& a, const ConvexPart& b, const Place& at, BatchKind kind,
                   Exact exact = Exact::kFcl) {
  World world;
  world.members.push_back({body({&a, 1}), poses_at({0, 0, 0}, PoseFormat::kMatrix3x4Rows, true, false), kind});
  world.members.push_back({body({&b, 1}), poses_at(at, PoseFormat::kMatrix3x4Rows, true, true), kind});
  const EnginePtr engine = make_engine_for(world);
  const BatchInput inputs[] = {world.members[0].poses.input({1}), world.members[1].poses.input({2})};
  const PairRule rule = {{1}, {2}, Pairing::kBetween};
  Hit hit;
  Contact contact = {};
  FrameJob job;
  job.inputs = {inputs, 2};
  job.rules = {&rule, 1};
  job.policies = {Refit::kCab, Strategy::kTree, exact};
  job.hits = {&hit, 1};
  job.contacts = {&contact, 1};
  REQUIRE(run_frame(*engine, job) == Status::kOk);
  REQUIRE(job.hit_count == 1);
  return contact;
}

// The largest difference of a contact's normal and depth from the expected ones. The normal must have unit length.
struct ContactError {
  double normal = 0, depth = 0;
};

ContactError error_of(const Contact& contact, const oracle::Vec3<double>& normal, double depth) {
  ContactError out;
  double length_sq = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    const auto component = static_cast<double>(contact.normal[c]);
    out.normal = std::max(out.normal, std::fabs(component - normal[c]));
    length_sq += component * component;
  }
  CHECK(std::fabs(std::sqrt(length_sq) - 1) < 1e-6);
  out.depth = std::fabs(static_cast<double>(contact.depth) - depth);
  return out;
}

void check_box_contact(const Contact& contact, const oracle::Vec3<double>& normal, double depth) {
  const ContactError error = error_of(contact, normal, depth);
  CHECK(error.normal <= kBoxTolerance);
  CHECK(error.depth <= kBoxTolerance);
}

}  // namespace

TEST_CASE("the contact of two boxes: normal from a to b, depth, and a point between, relative to a's origin") {
  const ConvexPart cube = shape(ShapeKind::kBox, 1, 1, 1);
  for (const BatchKind kind : {BatchKind::kCharacters, BatchKind::kSequence}) {
    Contact contact = contact_of(cube, cube, {1.9, 0.25, -0.5}, kind);
    check_box_contact(contact, {{1, 0, 0}}, 0.1);
    for (const float* const point : {contact.point_a, contact.point_b}) {
      CHECK(point[0] >= 0.9f - 1e-5f);
      CHECK(point[0] <= 1.0f + 1e-5f);
    }
    check_box_contact(contact_of(cube, cube, {-0.25, -1.8, 0.5}, kind), {{0, -1, 0}}, 0.2);
    check_box_contact(contact_of(cube, cube, {0, 0, 1.75, kPi / 4}, kind), {{0, 0, 1}}, 0.25);
    check_box_contact(contact_of(cube, cube, {1 + std::sqrt(2.0) - 0.1, 0, 0, kPi / 4}, kind), {{1, 0, 0}}, 0.1);
  }
}

TEST_CASE("the contact of two spheres: along their centres, as deep as they overlap") {
  const ConvexPart ball = shape(ShapeKind::kEllipsoid, 1, 1, 1);
  ContactError worst;
  for (const BatchKind kind : {BatchKind::kCharacters, BatchKind::kSequence}) {
    for (double angle = 0.1; angle < 6; angle += 0.9) {
      CAPTURE(angle);
      const oracle::Vec3<double> n = {{0.8 * std::cos(angle), 0.8 * std::sin(angle), -0.6}};
      const Contact contact = contact_of(ball, ball, {1.8 * n[0], 1.8 * n[1], 1.8 * n[2]}, kind);
      const ContactError error = error_of(contact, n, 0.2);
      worst.normal = std::max(worst.normal, error.normal);
      worst.depth = std::max(worst.depth, error.depth);
      for (std::size_t c = 0; c < 3; ++c)  // between the surfaces, at most 0.1 from the middle
        for (const float* const point : {contact.point_a, contact.point_b})
          CHECK(std::fabs(static_cast<double>(point[c]) - 0.9 * n[c]) <= 0.1 + kEllipsoidTolerance);
    }
  }
  CAPTURE(worst.normal);
  CAPTURE(worst.depth);
  CHECK(worst.normal <= kEllipsoidTolerance);
  CHECK(worst.depth <= kEllipsoidTolerance);
}

TEST_CASE("exact hits are a part of box hits, counted, and the same for any strategy, refit and thread count") {
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    CAPTURE(seed);
    Random random(seed);
    World world;
    add_characters(random, world, 10);
    add_frames(random, world, 10);
    // Every leaf is an ellipsoid inscribed in its box, so that boxes raise false positives.
    std::vector<std::vector<ConvexPart>> parts;
    for (Member& member : world.members) {
      parts.emplace_back();
      for (const Leaf& leaf : member.rig.leaves) {
        ConvexPart part = shape(ShapeKind::kEllipsoid, leaf.box.half[0], leaf.box.half[1], leaf.box.half[2]);
        std::copy_n(leaf.box.center, 3, part.position);
        double m[3][3];  // the box's axes as a quaternion, from the trace if it is large enough
        for (int k = 0; k < 3; ++k)
          for (int c = 0; c < 3; ++c) m[k][c] = static_cast<double>(leaf.box.axis[k][c]);
        const double w = std::sqrt(std::max(0.0, 1 + m[0][0] + m[1][1] + m[2][2])) / 2;
        if (w > 0.1) {
          part.rotation[0] = static_cast<float>((m[1][2] - m[2][1]) / (4 * w));
          part.rotation[1] = static_cast<float>((m[2][0] - m[0][2]) / (4 * w));
          part.rotation[2] = static_cast<float>((m[0][1] - m[1][0]) / (4 * w));
          part.rotation[3] = static_cast<float>(w);
        } else {  // a ball fits for any axes
          for (float& size : part.size) size = std::min({leaf.box.half[0], leaf.box.half[1], leaf.box.half[2]});
        }
        for (float& size : part.size) size *= 0.999f;
        parts.back().push_back(part);
      }
    }
    for (std::size_t m = 0; m < world.members.size(); ++m)
      for (std::size_t leaf = 0; leaf < parts[m].size(); ++leaf)
        world.members[m].rig.leaves[leaf].parts = {&parts[m][leaf], 1};

    const Outcome boxes = run_world(world), tree = run_world(world, kExactTree),
                  brute = run_world(world, {Refit::kCab, Strategy::kBrute, Exact::kFcl});
    CHECK(tree.stats.leaf_pairs == boxes.stats.leaf_pairs);
    CHECK(tree.stats.exact_tests <= tree.stats.leaf_pairs);
    CHECK(tree.stats.exact_tests >= boxes.hits.size());
    CHECK(tree.stats.false_positives <= tree.stats.exact_tests);
    CHECK(tree.stats.exact_tests - tree.stats.false_positives == tree.hits.size());
    CHECK(boxes.stats.exact_tests == 0);
    CHECK(missing_from(tree.hits, boxes.hits) == 0);
    CHECK(same_hits(tree.hits, brute.hits));
    const Outcome hull = run_world(world, {Refit::kAabbHull, Strategy::kTree, Exact::kFcl});
    CHECK(hull.stats.leaf_pairs >= tree.stats.leaf_pairs);
    CHECK(same_hits(hull.hits, tree.hits));
    EngineDesc desc;
    desc.thread_count = 2;
    CHECK(same_hits(run_world(world, kExactTree, desc).hits, tree.hits));
  }
}

TEST_CASE("a contact with a half space: the lowest point, and the point of the plane above it, by either test") {
  const ConvexPart floor = shape(ShapeKind::kHalfSpace, 0, 0, 0);
  const struct {
    ConvexPart part;
    double below;  // how far it reaches below its centre
  } others[] = {{shape(ShapeKind::kSphere, 0.5f, 0, 0), 0.5},
                {shape(ShapeKind::kEllipsoid, 2, 1, 0.75f), 0.75},
                {shape(ShapeKind::kCapsule, 0.5f, 1, 0), 1.5}};
  for (const auto& other : others)
    for (const double depth : {0.125, 1.0, 2.0})
      for (const Exact exact : {Exact::kFcl, Exact::kConvex}) {
        CAPTURE(other.below);
        CAPTURE(depth);
        const double z = other.below - depth;
        const Contact above = contact_of(floor, other.part, {1, 0.5, z}, BatchKind::kCharacters, exact);
        CHECK(error_of(above, {{0, 0, 1}}, depth).normal <= kEllipsoidTolerance);
        CHECK(error_of(above, {{0, 0, 1}}, depth).depth <= kEllipsoidTolerance);
        const double on_plane[] = {1, 0.5, 0}, lowest[] = {1, 0.5, -depth};
        for (std::size_t c = 0; c < 3; ++c) {
          CHECK(std::fabs(static_cast<double>(above.point_a[c]) - on_plane[c]) <= kEllipsoidTolerance);
          CHECK(std::fabs(static_cast<double>(above.point_b[c]) - lowest[c]) <= kEllipsoidTolerance);
        }
        const Contact below = contact_of(other.part, floor, {1, 0.5, -z}, BatchKind::kCharacters, exact);
        CHECK(error_of(below, {{0, 0, -1}}, depth).normal <= kEllipsoidTolerance);
        CHECK(error_of(below, {{0, 0, -1}}, depth).depth <= kEllipsoidTolerance);
        CHECK(std::fabs(static_cast<double>(below.point_a[2]) + other.below) <= kEllipsoidTolerance);
        CHECK(std::fabs(static_cast<double>(below.point_b[2]) + z) <= kEllipsoidTolerance);
      }
  const Contact none = contact_of(floor, floor, {1, 0.5, 1}, BatchKind::kCharacters, Exact::kConvex);
  CHECK(none.depth == 0);
  CHECK(none.normal[2] == 0);
}

namespace {

constexpr std::uint32_t kPlaces = 300;  // random poses of each pair of bodies

// Two bodies, and where the second stands in each of kPlaces frames, in the unit 1.
struct Bodies {
  std::vector<ConvexPart> parts[2];
  std::vector<float> vertices;           // of every hull
  std::vector<double> place_a, place_b;  // per frame: quaternion x y z w, translation
};

const std::vector<float> kCube = {1, 1, 1, 1, 1, -1, 1, -1, 1, 1, -1, -1, -1, 1, 1, -1, 1, -1, -1, -1, 1, -1, -1, -1};

// What a run says of two bodies: hits and contacts.
struct Answers {
  std::vector<Hit> hits;
  std::vector<Contact> contacts;
};

Answers answers_of(const Bodies& bodies, double unit, double margin = 0) {
  const auto in_unit = [unit](double length) { return static_cast<float>(length * unit); };
  World world;
  std::vector<ConvexPart> parts[2];
  std::vector<std::vector<float>> vertices;
  vertices.reserve(8);
  for (int m = 0; m < 2; ++m) {
    parts[m] = bodies.parts[m];
    for (ConvexPart& part : parts[m]) {
      for (float& size : part.size) size = in_unit(static_cast<double>(size));
      for (float& coordinate : part.position) coordinate = in_unit(static_cast<double>(coordinate));
      if (part.vertices.size == 0) continue;
      vertices.emplace_back();
      for (const float v : part.vertices) vertices.back().push_back(in_unit(static_cast<double>(v)));
      part.vertices = {vertices.back().data(), vertices.back().size()};
    }
    Rig rig = body(parts[m]);
    for (float& half : rig.leaves[0].box.half) half = in_unit(static_cast<double>(half));
    const std::vector<double>& places = m == 0 ? bodies.place_a : bodies.place_b;
    Poses poses;
    poses.link_count = 1;
    poses.instance_count = static_cast<std::uint32_t>(places.size() / 7);
    for (std::size_t i = 0; i < places.size(); ++i)
      poses.data.push_back(i % 7 < 4 ? static_cast<float>(places[i]) : in_unit(places[i]));
    world.members.push_back({rig, poses, BatchKind::kSequence});
  }
  const EnginePtr engine = make_engine_for(world);
  const BatchInput inputs[] = {world.members[0].poses.input({1}), world.members[1].poses.input({2})};
  const PairRule rule = {{1}, {2}, Pairing::kBetween};
  Answers out;
  out.hits.resize(bodies.place_a.size() / 7);
  out.contacts.resize(out.hits.size());
  FrameJob job;
  job.inputs = {inputs, 2};
  job.rules = {&rule, 1};
  job.policies = kExactTree;
  job.margin = in_unit(margin);
  job.hits = out.hits;
  job.contacts = out.contacts;
  REQUIRE(run_frame(*engine, job) == Status::kOk);
  out.hits.resize(job.hit_count);
  out.contacts.resize(job.hit_count);
  return out;
}

std::size_t hits_of(const Bodies& bodies, double unit) { return answers_of(bodies, unit).hits.size(); }

void append_place(std::vector<double>& places, const std::array<double, 4>& q, double x, double y, double z) {
  places.insert(places.end(), q.begin(), q.end());
  places.insert(places.end(), {x, y, z});
}

std::array<double, 4> random_rotation(Random& random) {
  std::array<double, 4> q;
  for (double& v : q) v = random.uniform(-1, 1);
  q[3] += q[3] < 0 ? -0.1 : 0.1;
  return q;
}

// One more than the highest ShapeKind: an ellipsoid beside a box.
constexpr int kManyParts = 7;
constexpr int kHalfSpace = static_cast<int>(ShapeKind::kHalfSpace);

// Two bodies of any kinds, of at most radius 1.5 but for half spaces, whose centres are up to 3 apart and up to 10 from
// the origin.
Bodies random_bodies(Random& random, int kind_a, int kind_b) {
  Bodies out;
  for (int i = 0; i < 60; ++i) out.vertices.push_back(static_cast<float>(random.uniform(-0.8, 0.8)));
  for (int m = 0; m < 2; ++m) {
    const int kind = m == 0 ? kind_a : kind_b;
    float size[3];  // one after the other, so that all compilers make the same bodies
    for (float& one : size) one = static_cast<float>(random.uniform(0.2, 0.8));
    ConvexPart part = shape(static_cast<ShapeKind>(kind % kManyParts), size[0], size[1], size[2]);
    if (part.kind == ShapeKind::kConvexHull) part = hull_of(m == 0 ? out.vertices : kCube);
    out.parts[m].push_back(part);
    if (kind == kManyParts)
      out.parts[m].push_back(moved(shape(ShapeKind::kEllipsoid, 0.25f, 0.5f, 0.25f), 0.5f, 0.5f, 0.7f));
  }
  for (std::uint32_t i = 0; i < kPlaces; ++i) {
    double a[3];
    for (double& c : a) c = random.uniform(-10, 10);
    append_place(out.place_a, random_rotation(random), a[0], a[1], a[2]);
    for (double& c : a) c += random.uniform(-1.7, 1.7);
    append_place(out.place_b, random_rotation(random), a[0], a[1], a[2]);
  }
  return out;
}

}  // namespace

TEST_CASE("two shapes apart by a tenth of their size are apart in every unit of length") {
  Bodies bodies;
  bodies.parts[0] = {shape(ShapeKind::kEllipsoid, 1, 1, 1)};
  bodies.parts[1] = {hull_of(kCube)};
  append_place(bodies.place_a, {0, 0, 0, 1}, 0, 0, 0);
  append_place(bodies.place_b, {0.5, 0.5, 0.1, 1}, 2.3, 1.2, 0);
  for (const double unit : {1e-12, 1e-6, 1e-5, 1e-4, 1e-3, 1.0, 1e3, 1e12}) {
    CAPTURE(unit);
    CHECK(hits_of(bodies, unit) == 0);
  }
}

TEST_CASE("crossed capsules touch in every unit of length, however little they overlap") {
  for (const double depth : {1e-5, 1e-4, 3e-4}) {
    for (const double unit : {1e-6, 1e-3, 1e-2, 1.0, 1e3}) {
      CAPTURE(depth);
      CAPTURE(unit);
      Random random(7);
      for (int round = 0; round < 10; ++round) {
        Bodies bodies;
        const auto radius_a = static_cast<float>(random.uniform(0.2, 0.6)),
                   radius_b = static_cast<float>(random.uniform(0.2, 0.6));
        bodies.parts[0] = {shape(ShapeKind::kCapsule, radius_a, 1, 0)};
        bodies.parts[1] = {shape(ShapeKind::kCapsule, radius_b, 1, 0)};
        const double gap = static_cast<double>(radius_a) + static_cast<double>(radius_b) - depth;
        for (int i = 0; i < 30; ++i) {
          append_place(bodies.place_a, {0, 0, 0, 1}, 0, 0, 0);
          append_place(bodies.place_b, {0, std::sqrt(0.5), 0, std::sqrt(0.5)}, random.uniform(-0.9, 0.9), gap,
                       random.uniform(-0.9, 0.9));
        }
        CHECK(hits_of(bodies, unit) == 30);
      }
    }
  }
}

TEST_CASE("bodies in deep overlap touch, tiny and huge ones too") {
  for (const double unit : {1e-30, 1e-20, 1e-16, 1e-6, 1.0, 1e6, 1e16}) {
    for (int kind = 0; kind < kManyParts; ++kind) {
      CAPTURE(unit);
      CAPTURE(kind);
      Bodies bodies;
      const ConvexPart part = kind == 3 ? hull_of(kCube) : shape(static_cast<ShapeKind>(kind), 1, 1, 1);
      bodies.parts[0] = bodies.parts[1] = {part};
      append_place(bodies.place_a, {0, 0, 0, 1}, 0, 0, 0);
      append_place(bodies.place_b, {0.1, 0.2, 0.3, 1}, 0.3, 0.2, -0.1);
      CHECK(hits_of(bodies, unit) == 1);
    }
  }
}

TEST_CASE("in a unit of length that is a power of two, hits and contacts have the same bits") {
  Random random(3);
  for (int kind_a = 0; kind_a <= kManyParts; ++kind_a) {
    for (int kind_b = 0; kind_b <= kManyParts; ++kind_b) {
      const Bodies bodies = random_bodies(random, kind_a, kind_b);
      for (const double margin : {0.0, 0.25}) {
        const Answers one = answers_of(bodies, 1, margin);
        CHECK(one.hits.size() > 0);
        CHECK((one.hits.size() < kPlaces || (kind_a == kHalfSpace && kind_b == kHalfSpace)));
        for (const int exponent : {-40, -13, -1, 1, 40}) {
          CAPTURE(kind_a);
          CAPTURE(kind_b);
          CAPTURE(margin);
          CAPTURE(exponent);
          const float unit = std::ldexp(1.0f, exponent);
          const Answers other = answers_of(bodies, static_cast<double>(unit), margin);
          REQUIRE(same_hits(other.hits, one.hits));
          std::size_t different = 0;
          for (std::size_t i = 0; i < one.hits.size(); ++i) {
            Contact expected = one.contacts[i];
            expected.depth *= unit;
            for (float& coordinate : expected.point_a) coordinate *= unit;
            for (float& coordinate : expected.point_b) coordinate *= unit;
            different += std::memcmp(&expected, &other.contacts[i], sizeof(Contact)) != 0;
          }
          CHECK(different == 0);
        }
      }
    }
  }
}

TEST_CASE("in any other unit of length, hits are the same, and contacts to FCL's own accuracy") {
  Random random(4);
  std::size_t contacts = 0, different = 0;
  for (int kind_a = 0; kind_a <= kManyParts; ++kind_a) {
    for (int kind_b = 0; kind_b <= kManyParts; ++kind_b) {
      const Bodies bodies = random_bodies(random, kind_a, kind_b);
      const Answers one = answers_of(bodies, 1);
      for (const double unit : {1e-12, 1e-4, 1e5, 1e12}) {
        CAPTURE(kind_a);
        CAPTURE(kind_b);
        CAPTURE(unit);
        const Answers other = answers_of(bodies, unit);
        REQUIRE(same_hits(other.hits, one.hits));
        if (kind_a == 3 || kind_b == 3) continue;  // another face of a hull may be chosen by a last bit
        for (std::size_t i = 0; i < one.hits.size(); ++i) {
          const double depth = static_cast<double>(other.contacts[i].depth) / unit;
          different += std::fabs(depth - static_cast<double>(one.contacts[i].depth)) > 0.01;
          ++contacts;
        }
      }
    }
  }
  CHECK(contacts > 1000);
  CHECK(different * 1000 <= contacts);
}

TEST_CASE("a hull is accepted when no file can be opened") {
  const ConvexPart hull = hull_of(kCube);
  const Rig rig = body({&hull, 1});
  const EnginePtr engine = make_engine();
  ArticulationId id = {};
  rlimit before = {};
  REQUIRE(getrlimit(RLIMIT_NOFILE, &before) == 0);
  rlimit few = before;
  few.rlim_cur = 3;
  REQUIRE(setrlimit(RLIMIT_NOFILE, &few) == 0);
  const Status status = add_articulation(*engine, rig.desc(), &id);
  REQUIRE(setrlimit(RLIMIT_NOFILE, &before) == 0);
  CHECK(status == Status::kOk);
}

namespace {

// A sphere of radius 1 whose link stands up to 1e9 away, while the sphere itself is near the origin. Returns its
// centre.
oracle::Vec3<long double> add_far_sphere(Random& random, ConvexPart& sphere, World& world) {
  Poses poses;
  poses.link_count = poses.instance_count = 1;
  long double q[4], length_sq = 0;
  for (const double v : random_rotation(random)) poses.data.push_back(static_cast<float>(v));
  for (int i = 0; i < 4; ++i) q[i] = static_cast<long double>(poses.data[static_cast<std::size_t>(i)]);
  for (const long double v : q) length_sq += v * v;
  const long double x = q[0], y = q[1], z = q[2], w = q[3], s = 2 / length_sq;
  const long double m[3][3] = {{1 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y)},
                               {s * (x * y + w * z), 1 - s * (x * x + z * z), s * (y * z - w * x)},
                               {s * (x * z - w * y), s * (y * z + w * x), 1 - s * (x * x + y * y)}};
  for (int c = 0; c < 3; ++c) poses.data.push_back(static_cast<float>(random.uniform(-1e9, 1e9)));
  sphere = shape(ShapeKind::kEllipsoid, 1, 1, 1);
  oracle::Vec3<long double> center;
  for (std::size_t c = 0; c < 3; ++c) {
    long double back = 0;
    for (std::size_t r = 0; r < 3; ++r) back -= m[r][c] * static_cast<long double>(poses.data[4 + r]);
    sphere.position[c] = static_cast<float>(back);
  }
  for (std::size_t r = 0; r < 3; ++r) {
    center[r] = static_cast<long double>(poses.data[4 + r]);
    for (std::size_t c = 0; c < 3; ++c) center[r] += m[r][c] * static_cast<long double>(sphere.position[c]);
  }
  Rig rig = body({&sphere, 1});
  std::copy_n(sphere.position, 3, rig.leaves[0].box.center);
  world.members.push_back({rig, poses, BatchKind::kCharacters});
  return center;
}

}  // namespace

TEST_CASE("a pair within the margin is reported though its links stand far from their shapes and the origin") {
  Random random(11);
  int asked = 0, lost = 0;
  for (int round = 0; round < 400; ++round) {
    World world;
    ConvexPart spheres[2];
    const auto a = add_far_sphere(random, spheres[0], world), b = add_far_sphere(random, spheres[1], world);
    long double distance_sq = 0;
    for (std::size_t c = 0; c < 3; ++c) distance_sq += (b[c] - a[c]) * (b[c] - a[c]);
    const long double gap = std::sqrt(distance_sq) - 2;
    if (!(gap > 0)) continue;
    world.margin = static_cast<float>(gap);
    if (static_cast<long double>(world.margin) < gap) world.margin = std::nextafter(world.margin, 1e18f);
    world.rules = {{{1}, {2}, Pairing::kBetween}};
    ++asked;
    lost += run_world(world, kExactTree).hits.empty();
  }
  CHECK(asked > 200);
  CHECK(lost == 0);
}
