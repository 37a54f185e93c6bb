// The exact test by FCL: yes and no against answers worked out by hand, contacts, and its counts.
#include "perf/oracle/random_world.h"

#include <doctest/doctest.h>

#include <cmath>

namespace {

using namespace cab;
using namespace cab::oracle;

constexpr Policies kExactTree = {Refit::kCab, Strategy::kTree, Exact::kFcl};
constexpr Policies kExactBrute = {Refit::kCab, Strategy::kBrute, Exact::kFcl};
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
  part.vertices = {vertices.data(), vertices.size()};
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

// Whether two bodies touch. The answer must be the same for every way to place them, as characters and as sequences.
bool touch(Span<const ConvexPart> a, Span<const ConvexPart> b, const Place& at) {
  int yes = 0, asked = 0;
  for (const PoseFormat format : {PoseFormat::kQuaternionTranslation, PoseFormat::kMatrix3x4, PoseFormat::kMatrix4x4}) {
    for (const BatchKind kind : {BatchKind::kCharacters, BatchKind::kSequence}) {
      for (const bool by_origin : {false, true}) {
        World world;
        world.members.push_back({body(a), poses_at({0, 0, 0}, format, by_origin, false), kind});
        world.members.push_back({body(b), poses_at(at, format, by_origin, by_origin), kind});
        world.rules = {{{1}, {2}, Pairing::kBetween}};
        const Outcome outcome = run_world(world, asked % 2 ? kExactTree : kExactBrute);
        CHECK(outcome.stats.exact_tests == outcome.stats.leaf_pairs);
        CHECK(outcome.hits.size() == outcome.stats.exact_tests - outcome.stats.false_positives);
        yes += outcome.hits.size() == 1;
        ++asked;
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
      {body({}), poses_at({0, 0, 0}, PoseFormat::kMatrix3x4, false, false), BatchKind::kCharacters});
  world.members.push_back(
      {body({}), poses_at({3.5, 0, 0}, PoseFormat::kMatrix3x4, false, false), BatchKind::kCharacters});
  world.rules = {{{1}, {2}, Pairing::kBetween}};
  for (int flat = 1; flat <= 3; ++flat) {
    CAPTURE(flat);
    for (int k = 0; k < flat; ++k) world.members[1].rig.leaves[0].box.half[k] = 0;
    CHECK(run_world(world, kExactTree).hits.size() == 0);
    world.members[1].poses = poses_at({1, 0.5, 0.25}, PoseFormat::kMatrix3x4, false, false);
    CHECK(run_world(world, kExactTree).hits.size() == 1);
    world.members[1].poses = poses_at({3.5, 0, 0}, PoseFormat::kMatrix3x4, false, false);
  }
}

TEST_CASE("a hull whose vertices have no volume is refused with its leaf") {
  const std::vector<float> flat = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 0.5f, 0.25f, 0};
  const std::vector<float> line = {0, 0, 0, 1, 1, 1, 2, 2, 2, -1, -1, -1};
  const std::vector<float> point(12, 0.5f);
  const std::vector<float> solid = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  for (const auto* const vertices : {&flat, &line, &point}) {
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
Contact contact_of(const ConvexPart& a, const ConvexPart& b, const Place& at, BatchKind kind) {
  World world;
  world.members.push_back({body({&a, 1}), poses_at({0, 0, 0}, PoseFormat::kMatrix3x4, true, false), kind});
  world.members.push_back({body({&b, 1}), poses_at(at, PoseFormat::kMatrix3x4, true, true), kind});
  const EnginePtr engine = make_engine_for(world);
  const BatchInput inputs[] = {world.members[0].poses.input({1}), world.members[1].poses.input({2})};
  const PairRule rule = {{1}, {2}, Pairing::kBetween};
  Hit hit;
  Contact contact = {};
  FrameJob job;
  job.inputs = {inputs, 2};
  job.rules = {&rule, 1};
  job.policies = kExactTree;
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
    CHECK(contact.point[0] >= 0.9f - 1e-5f);
    CHECK(contact.point[0] <= 1.0f + 1e-5f);
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
        CHECK(std::fabs(static_cast<double>(contact.point[c]) - 0.9 * n[c]) <= 0.1 + kEllipsoidTolerance);
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

    const Outcome boxes = run_world(world), tree = run_world(world, kExactTree), brute = run_world(world, kExactBrute);
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
