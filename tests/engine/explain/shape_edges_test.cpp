// box_lines with shapes and contacts: lines lie on the surface of the exact shapes, and contacts join their two points.
#include "perf/harness/world.h"
#include "perf/judge/oracle/random.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <vector>

namespace cab::tests {
namespace {

using oracle::EnginePtr;
using oracle::make_engine;
using oracle::Random;
using Point = std::array<double, 3>;

// Shapes are 0.3 to 0.6 large, at most 40 from the origin of the world: an end of a line is off by 1e-5 at most here.
constexpr double kTolerance = 1e-3;
// By how much an end is moved away from the middle of its shape to be outside.
constexpr double kOutwards = 1.05;

constexpr ShapeKind kKinds[] = {ShapeKind::kBox,    ShapeKind::kEllipsoid, ShapeKind::kCapsule,  ShapeKind::kConvexHull,
                                ShapeKind::kSphere, ShapeKind::kCylinder,  ShapeKind::kHalfSpace};
constexpr std::uint32_t kKindCount = 7;
constexpr std::size_t kLines[kKindCount] = {12, 48, 68, 6, 48, 36, 12};
constexpr std::uint32_t kHalfSpaceLink = 6;

void random_quaternion(Random& random, float (&out)[4]) {
  double q[4], length = 0;
  for (double& c : q) {
    c = random.normal();
    length += c * c;
  }
  for (int c = 0; c < 4; ++c) out[c] = static_cast<float>(q[c] / std::sqrt(length));
}

std::vector<BoxLine> lines_of(Engine& engine, const BatchInput& input, BoxLinesJob job) {
  REQUIRE(box_lines(engine, input, job) == Status::kLinesOverflow);
  std::vector<BoxLine> out(job.lines_needed);
  job.lines = out;
  REQUIRE(box_lines(engine, input, job) == Status::kOk);
  REQUIRE(job.line_count == out.size());
  return out;
}

Point end_of(const float (&end)[3], const double (&origin)[3]) {
  return {end[0] + origin[0], end[1] + origin[1], end[2] + origin[2]};
}

// Whether the link's exact shape is within kTolerance of each point.
std::vector<bool> near_link(Engine& engine, const BatchInput& input, const std::vector<Point>& points,
                            std::uint32_t instance, std::uint16_t link) {
  std::vector<Query> queries(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    queries[i].kind = QueryKind::kSphere;
    queries[i].want = QueryWant::kAll;
    queries[i].radius = static_cast<float>(kTolerance);
    std::copy(points[i].begin(), points[i].end(), queries[i].position);
  }
  const ReserveDesc reserve = {0, 0, static_cast<std::uint32_t>(points.size()), 0};
  REQUIRE(cab::reserve(engine, reserve) == Status::kOk);
  std::vector<QueryHit> hits(points.size() * kKindCount * 3);
  QueryJob job;
  job.inputs = {&input, 1};
  job.queries = queries;
  job.exact = Exact::kConvex;
  job.hits = hits;
  REQUIRE(run_queries(engine, job) == Status::kOk);
  std::vector<bool> out(points.size());
  for (std::size_t i = 0; i < job.hit_count; ++i)
    if (hits[i].instance == instance && hits[i].link == link) out[hits[i].query] = true;
  return out;
}

// Three scaled instances of seven links with a shape of each kind.
struct Body {
  static constexpr float kHull[] = {0.5f, 0, 0, -0.3f, 0.4f, 0, -0.3f, -0.4f, 0, 0, 0, 0.6f};
  static constexpr std::uint32_t kInstances = 3;

  EnginePtr engine = make_engine();
  BatchId batch = {};
  std::vector<float> poses, scales;
  std::vector<double> origins;

  explicit Body(Random& random) {
    std::vector<std::int32_t> parents;
    std::vector<ConvexPart> parts(kKindCount);
    std::vector<Leaf> leaves(kKindCount);
    for (std::uint32_t link = 0; link < kKindCount; ++link) {
      parents.push_back(static_cast<std::int32_t>(link) - 1);
      ConvexPart& part = parts[link];
      part.kind = kKinds[link];
      if (part.kind == ShapeKind::kConvexHull) part.vertices = kHull;
      for (float& size : part.size) size = static_cast<float>(random.uniform(0.3, 0.6));
      for (float& c : part.position) c = static_cast<float>(random.uniform(-0.3, 0.3));
      random_quaternion(random, part.rotation);
      leaves[link].link = link;
      for (float& half : leaves[link].box.half) half = 3;
      leaves[link].parts = {&part, 1};
    }
    ArticulationDesc desc;
    desc.link_parents = parents;
    desc.leaves = leaves;
    ArticulationId id;
    REQUIRE(add_articulation(*engine, desc, &id) == Status::kOk);
    REQUIRE(add_batch(*engine, {id, kInstances, BatchKind::kCharacters}, &batch) == Status::kOk);
    for (std::uint32_t i = 0; i < kInstances; ++i) {
      scales.push_back(static_cast<float>(random.uniform(0.8, 1.6)));
      for (int c = 0; c < 3; ++c) origins.push_back(random.uniform(-20, 20));
      for (std::uint32_t link = 0; link < kKindCount; ++link) {
        float turn[4];
        random_quaternion(random, turn);
        poses.insert(poses.end(), turn, turn + 4);
        for (int c = 0; c < 3; ++c) poses.push_back(static_cast<float>(random.uniform(-8, 8)));
      }
    }
  }

  BatchInput input() const {
    BatchInput out;
    out.batch = batch;
    out.poses = {PoseFormat::kQuaternionTranslation, poses.data()};
    out.origins = origins;
    out.scales = scales;
    return out;
  }
};

// Two balls of radius 1 whose centres are 1.5 apart, at an origin.
struct Balls {
  EnginePtr engine = make_engine();
  BatchId batch = {};
  float poses[14] = {0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0};
  double origins[6] = {5, 6, 7, 6.5, 6, 7};
  Hit hit;
  Contact contact;

  Balls() {
    const std::int32_t parent = -1;
    ConvexPart part;
    part.kind = ShapeKind::kSphere;
    part.size[0] = 1;
    Leaf leaf;
    for (float& half : leaf.box.half) half = 1;
    leaf.parts = {&part, 1};
    ArticulationDesc desc;
    desc.link_parents = {&parent, 1};
    desc.leaves = {&leaf, 1};
    ArticulationId id;
    REQUIRE(add_articulation(*engine, desc, &id) == Status::kOk);
    REQUIRE(add_batch(*engine, {id, 2, BatchKind::kCharacters}, &batch) == Status::kOk);
    const BatchInput given = input();
    const PairRule rule = {batch, batch};
    FrameJob job;
    job.inputs = {&given, 1};
    job.rules = {&rule, 1};
    job.policies.exact = Exact::kConvex;
    job.hits = {&hit, 1};
    job.contacts = {&contact, 1};
    REQUIRE(run_frame(*engine, job) == Status::kOk);
    REQUIRE(job.hit_count == 1);
  }

  BatchInput input() const {
    BatchInput out;
    out.batch = batch;
    out.poses = {PoseFormat::kQuaternionTranslation, poses};
    out.origins = origins;
    return out;
  }
};

}  // namespace

TEST_CASE("the ends of lines of a shape are on its surface") {
  for (std::uint64_t seed = 1; seed <= rounds(20); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    const Body body(random);
    BoxLinesJob job;
    job.shapes = true;
    for (double& c : job.origin) c = random.uniform(-20, 20);
    std::map<std::pair<std::uint32_t, std::uint16_t>, std::vector<Point>> ends;
    for (const BoxLine& line : lines_of(*body.engine, body.input(), job)) {
      CHECK(line.node == line.link);
      CHECK(!line.is_hit);
      std::vector<Point>& of = ends[{line.instance, line.link}];
      of.push_back(end_of(line.from, job.origin));
      of.push_back(end_of(line.to, job.origin));
    }
    REQUIRE(ends.size() == Body::kInstances * kKindCount);
    for (const auto& [key, points] : ends) {
      const std::uint32_t instance = key.first;
      const std::uint16_t link = key.second;
      CAPTURE(link);
      REQUIRE(points.size() == 2 * kLines[link]);
      if (link == kHalfSpaceLink) continue;
      Point middle = {0, 0, 0};
      for (const Point& point : points)
        for (std::size_t c = 0; c < 3; ++c) middle[c] += point[c] / static_cast<double>(points.size());
      std::vector<Point> outside;
      for (const Point& point : points) {
        outside.push_back(middle);
        for (std::size_t c = 0; c < 3; ++c) outside.back()[c] += kOutwards * (point[c] - middle[c]);
      }
      const std::vector<bool> on = near_link(*body.engine, body.input(), points, instance, link);
      CHECK(std::count(on.begin(), on.end(), false) == 0);
      const std::vector<bool> off = near_link(*body.engine, body.input(), outside, instance, link);
      CHECK(std::count(off.begin(), off.end(), true) == 0);
    }
  }
}

TEST_CASE("what has no edges of its own is drawn as its box, and levels above the leaves are too") {
  Random random(1);
  const EnginePtr engine = make_engine();
  // A hull of more vertices than have known edges, a leaf without parts, and one of a triangle.
  std::vector<float> vertices;
  for (int i = 0; i < 300; ++i)
    for (const double c : random.unit_vector().v) vertices.push_back(static_cast<float>(c));
  ConvexPart hull;
  hull.kind = ShapeKind::kConvexHull;
  hull.vertices = vertices;
  const std::int32_t parents[] = {-1, 0, 1};
  const std::uint32_t corners[] = {0, 1, 2}, links[] = {2, 2, 2};
  const float skin[] = {0, 0, 0, 1, 0, 0, 0, 1, 0.5f}, weights[] = {1, 1, 1};
  Leaf leaves[3];
  for (std::uint32_t link = 0; link < 3; ++link) {
    leaves[link].link = link;
    for (float& half : leaves[link].box.half) half = 1.25f;
  }
  leaves[0].parts = {&hull, 1};
  leaves[2].triangles = corners;
  ArticulationDesc desc;
  desc.link_parents = parents;
  desc.leaves = leaves;
  desc.skin = {skin, 1, links, weights, {}};
  ArticulationId id;
  REQUIRE(add_articulation(*engine, desc, &id) == Status::kOk);
  BatchId batch;
  REQUIRE(add_batch(*engine, {id, 1, BatchKind::kCharacters}, &batch) == Status::kOk);
  const float poses[] = {0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1, 4, 0, 0, 0, 0, 0, 1, 8, 0, 0};
  BatchInput input;
  input.batch = batch;
  input.poses = {PoseFormat::kQuaternionTranslation, poses};
  for (const std::uint32_t level : {0u, kLeafLevel}) {
    BoxLinesJob job;
    job.level = level;
    const std::vector<BoxLine> boxes = lines_of(*engine, input, job);
    job.shapes = true;
    const std::vector<BoxLine> shapes = lines_of(*engine, input, job);
    REQUIRE(boxes.size() == (level == 0 ? 12 : 36));
    REQUIRE(shapes.size() == boxes.size());
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      CHECK(shapes[i].node == boxes[i].node);
      if (boxes[i].link == 1) {  // the edges of its box without padding, in another order
        for (const auto& end : {shapes[i].from, shapes[i].to})
          for (int c = 0; c < 3; ++c) CHECK(std::fabs(std::fabs(end[c] - (c == 0 ? 4 : 0)) - 1.25) < kTolerance);
      } else {
        CHECK(std::equal(boxes[i].from, boxes[i].from + 3, shapes[i].from));
        CHECK(std::equal(boxes[i].to, boxes[i].to + 3, shapes[i].to));
      }
    }
  }
}

TEST_CASE("a contact is a line between its two points, after all boxes") {
  const Balls balls;
  BoxLinesJob job;
  job.origin[0] = 1;
  job.hits = {&balls.hit, 1};
  CHECK(lines_of(*balls.engine, balls.input(), job).size() == 24);
  job.contacts = {&balls.contact, 1};
  const std::vector<BoxLine> lines = lines_of(*balls.engine, balls.input(), job);
  REQUIRE(lines.size() == 25);
  const BoxLine& last = lines.back();
  // The points that are deepest: 1 from the first centre, and 0.5 from it.
  const float from[] = {5, 6, 7}, to[] = {4.5f, 6, 7};
  for (int c = 0; c < 3; ++c) {
    CHECK(std::fabs(last.from[c] - from[c]) < kTolerance);
    CHECK(std::fabs(last.to[c] - to[c]) < kTolerance);
  }
  CHECK(last.is_hit);
  CHECK(last.instance == 0);
  CHECK(last.link == 0);
  CHECK(last.node == 0);
}

TEST_CASE("contacts of other batches are not drawn, and lists of other lengths are refused") {
  const Balls balls;
  BoxLinesJob job;
  Hit other = balls.hit;
  other.batch_a.value += 1;
  job.hits = {&other, 1};
  job.contacts = {&balls.contact, 1};
  CHECK(lines_of(*balls.engine, balls.input(), job).size() == 24);
  other = balls.hit;
  other.instance_a = 2;
  CHECK(lines_of(*balls.engine, balls.input(), job).size() == 24);
  const Contact two[2] = {balls.contact, balls.contact};
  job.contacts = two;
  CHECK(box_lines(*balls.engine, balls.input(), job) == Status::kBadPairs);
  job.contacts = {nullptr, 1};
  CHECK(box_lines(*balls.engine, balls.input(), job) == Status::kBadPairs);
}

TEST_CASE("static bodies are drawn as their shapes, each its own") {
  const EnginePtr engine = make_engine();
  ConvexPart part;
  part.kind = ShapeKind::kSphere;
  part.size[0] = 0.5f;
  StaticBody bodies[2];
  for (StaticBody& body : bodies)
    for (float& half : body.box.half) half = 1;
  bodies[1].parts = {&part, 1};
  bodies[1].origin[0] = 9;
  StaticDesc desc;
  desc.bodies = bodies;
  BatchId batch;
  REQUIRE(add_static_batch(*engine, desc, &batch) == Status::kOk);
  BatchInput input;
  input.batch = batch;
  BoxLinesJob job;
  job.shapes = true;
  std::size_t lines[2] = {0, 0};
  for (const BoxLine& line : lines_of(*engine, input, job)) {
    ++lines[line.instance];
    const double reach = line.instance == 0 ? std::sqrt(3.0) : 0.5, middle = line.instance == 0 ? 0 : 9;
    for (const auto& end : {line.from, line.to})
      CHECK(std::fabs(std::hypot(std::hypot(end[0] - middle, end[1]), end[2]) - reach) < kTolerance);
  }
  CHECK(lines[0] == 12);
  CHECK(lines[1] == kLines[4]);
}

}  // namespace cab::tests
