// CollisionChecker: the answers of the plain calls, for any number of states, and a status for every misuse.
#include <cab/collision_checker.h>

#include "perf/harness/random_joints.h"
#include "perf/harness/random_rig.h"
#include "perf/harness/world.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <vector>

namespace cab::tests {
namespace {

using namespace cab::oracle;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr float kPose[7] = {0, 0, 0, 1, 0, 0, 0};
constexpr std::int32_t kOneLink[] = {-1};

std::vector<double> random_states(Random& random, const JointedRig& robot, std::size_t count) {
  std::vector<double> states(count * robot.body.variable_count);
  for (double& x : states) x = random.uniform(-3, 3);
  return states;
}

// A world of one sequence with the poses of states, by the plain calls. Fixed bodies are sequences of one instance.
struct PlainWorld {
  explicit PlainWorld(const JointedRig& robot, const std::vector<double>& states) {
    const std::size_t count = states.size() / robot.body.variable_count;
    Member member;
    member.rig = robot.rig;
    member.kind = BatchKind::kSequence;
    member.poses.link_count = robot.rig.link_count();
    member.poses.instance_count = static_cast<std::uint32_t>(count);
    member.poses.data.resize(7 * count * robot.rig.link_count());
    REQUIRE(compute_link_poses(robot.body.desc(), states, Isa::kScalar, member.poses.data) == Status::kOk);
    world.members.push_back(member);
    world.rules.push_back({{1}, {1}, Pairing::kWithin});
  }
  void add_fixed(const Rig& rig, const std::vector<float>& poses) {
    Member member;
    member.rig = rig;
    member.kind = BatchKind::kSequence;
    member.poses.link_count = rig.link_count();
    member.poses.instance_count = 1;
    member.poses.data = poses;
    world.members.push_back(member);
    world.rules.push_back({{1}, {static_cast<std::uint32_t>(world.members.size())}, Pairing::kBetween});
  }
  Outcome run() const {
    Policies policies;
    policies.exact = Exact::kConvex;
    return run_world(world, policies);
  }

  oracle::World world;
};

Rig random_fixed(Random& random, std::vector<float>& poses) {
  const Rig rig = random_rig(random, Topology::kStar, 1 + random.index(3), 2);
  for (std::uint32_t l = 0; l < rig.link_count(); ++l) {
    double q[4];
    random_turn(random, q);
    float pose[7];
    write_pose(PoseFormat::kQuaternionTranslation, q, random.uniform(0.3, 1) * random.unit_vector(), pose);
    poses.insert(poses.end(), pose, pose + 7);
  }
  return rig;
}

// A jointed robot whose leaves have exact shapes in their boxes: balls and capsules alone, or all kinds.
struct ShapedRig {
  JointedRig rig;
  std::vector<ConvexPart> parts;
  std::vector<std::vector<float>> vertices;

  ShapedRig(Random& random, bool is_round) : rig(random_jointed_rig(random, 7, 2, 0.4)) {
    std::vector<Leaf>& leaves = rig.rig.leaves;
    parts.resize(leaves.size());
    vertices.resize(leaves.size());
    for (std::size_t l = 0; l < leaves.size(); ++l) {
      const Box& box = leaves[l].box;
      ConvexPart& part = parts[l];
      const float least = std::min({box.half[0], box.half[1], box.half[2]});
      std::copy_n(box.center, 3, part.position);
      std::fill_n(part.size, 3, 0.5f * least);  // which no kind needs more than the box has
      const unsigned kind = random.index(is_round ? 2 : 5);
      if (kind == 4) continue;  // the box itself
      part.kind = kind == 0   ? ShapeKind::kSphere
                  : kind == 1 ? ShapeKind::kCapsule
                  : kind == 2 ? ShapeKind::kCylinder
                              : ShapeKind::kConvexHull;
      for (int v = 0; v < 12 && kind == 3; ++v) {
        float at[3] = {0, 0, 0};
        for (int k = 0; k < 3; ++k) {
          const auto along = static_cast<float>(random.uniform(-0.99, 0.99)) * box.half[k];
          for (int c = 0; c < 3; ++c) at[c] += along * box.axis[k][c];
        }
        vertices[l].insert(vertices[l].end(), at, at + 3);
      }
      part.vertices = vertices[l];
      leaves[l].parts = {&part, 1};
    }
  }
};

// Refuses what has one link with a box.
struct Plain {
  JointedBody body;
  Leaf leaf = {0, axis_aligned_box({0, 0, 0}, {.5f, .5f, .5f}), {}};
  ArticulationDesc desc;
  Plain() {
    body.parents = {-1};
    body.links.resize(1);
    body.variable_count = 1;
    desc.link_parents = kOneLink;
    desc.leaves = {&leaf, 1};
  }
};

}  // namespace

TEST_CASE("states collide where frames of their poses have hits, alone and among fixed bodies") {
  std::size_t colliding = 0, free = 0;
  for (std::uint64_t seed = 1; seed <= rounds(40); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    const JointedRig robot = random_jointed_rig(random, 10, 2, 0.4);
    const std::size_t count = random.chance(0.2) ? 1000 + random.index(2000) : random.index(100);
    std::vector<double> states = random_states(random, robot, count);
    PlainWorld plain(robot, states);
    std::vector<std::vector<float>> poses(random.index(3));
    std::vector<Rig> fixed;
    for (std::vector<float>& pose : poses) fixed.push_back(random_fixed(random, pose));

    EngineDesc desc;
    desc.thread_count = 1 + random.index(2);
    CollisionChecker checker(desc);
    REQUIRE(checker.set_robot(robot.rig.desc(), robot.body.desc()) == Status::kOk);
    for (std::size_t f = 0; f < fixed.size(); ++f) {
      REQUIRE(checker.add_fixed(fixed[f].desc(), poses[f]) == Status::kOk);
      plain.add_fixed(fixed[f], poses[f]);
    }
    std::vector<StateAnswer> answers(count), expected(count, StateAnswer::kFree);
    std::vector<Hit> hits;
    if (count > 0) hits = plain.run().hits;
    for (const Hit& hit : hits) expected[hit.instance_a] = StateAnswer::kColliding;
    REQUIRE(checker.check(states, answers) == Status::kOk);
    CHECK(answers == expected);
    for (const StateAnswer answer : answers) ++(answer == StateAnswer::kFree ? free : colliding);

    std::vector<Hit> found;
    for (std::uint32_t first = 0; first < count; first += checker.chunk()) {
      const auto size = std::min(checker.chunk(), static_cast<std::uint32_t>(count) - first);
      const std::uint32_t variables = robot.body.variable_count;
      REQUIRE(checker.find_hits({states.data() + first * variables, size * variables}, size) == Status::kOk);
      CHECK(checker.flags().size == size);
      for (Hit hit : checker.world().hits()) {
        hit.instance_a += first;
        if (hit.batch_b == hit.batch_a) hit.instance_b = hit.instance_a;
        found.push_back(hit);
      }
    }
    // The plain world has all states in one batch, so its hits are sorted by state over all of them.
    CHECK(same_hits(found, hits));

    if (count > 0) {
      const std::size_t bad = random.index(static_cast<unsigned>(count));
      for (std::uint32_t v = 0; v < robot.body.variable_count; ++v) states[bad * robot.body.variable_count + v] = kNan;
      REQUIRE(checker.check(states, answers) == Status::kOk);
      if (!robot.body.joints.empty()) expected[bad] = StateAnswer::kNotTested;
      CHECK(answers == expected);
    }
  }
  CHECK(colliding >= least_count(500, 40));
  CHECK(free >= least_count(500, 40));
}

TEST_CASE("a margin makes states collide that come closer, and contacts say how close") {
  Plain plain;
  plain.body.links[0].joint_count = 1;
  plain.body.joints.resize(1);
  plain.body.joints[0].kind = JointKind::kPrismatic;
  CollisionChecker checker;
  REQUIRE(checker.set_robot(plain.desc, plain.body.desc()) == Status::kOk);
  const float poses[] = {0, 0, 0, 1, 0, 0, 2};
  REQUIRE(checker.add_fixed(plain.desc, poses) == Status::kOk);
  const std::vector<double> states = {0, 0.85, 1.25, 5};
  std::vector<StateAnswer> answers(4);
  const auto colliding = [&] {
    std::size_t out = 0;
    REQUIRE(checker.check(states, answers) == Status::kOk);
    for (const StateAnswer answer : answers) out += answer == StateAnswer::kColliding;
    return out;
  };
  CHECK(colliding() == 1);
  checker.world().job().margin = 0.2f;
  CHECK(colliding() == 2);
  CHECK(answers[1] == StateAnswer::kColliding);
  checker.world().want_contacts();
  REQUIRE(checker.find_hits(states, 4) == Status::kOk);
  const Span<const Contact> contacts = checker.world().contacts();
  REQUIRE(contacts.size == 2);
  CHECK(contacts[0].depth == doctest::Approx(-0.15));
  CHECK(contacts[1].depth == doctest::Approx(0.25));
}

TEST_CASE("points are what bodies of one ball are, in every answer") {
  std::size_t colliding = 0, free = 0, hit_points = 0;
  for (std::uint64_t seed = 1; seed <= rounds(25); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    const JointedRig robot = random_jointed_rig(random, 8, 2, 0.4);
    const std::size_t count = 1 + random.index(random.chance(0.2) ? 2000 : 80);
    const std::vector<double> states = random_states(random, robot, count);
    std::vector<float> around_poses, points;
    const Rig around = random_fixed(random, around_poses);
    const auto point_count = static_cast<std::uint32_t>(1 + random.index(40));
    const auto radius = static_cast<float>(random.uniform(0.01, 0.2));
    for (std::uint32_t i = 0; i < point_count; ++i)
      for (const double x : {random.normal(), random.normal(), random.normal()})
        points.push_back(static_cast<float>(x));

    CollisionChecker checker, plain;
    for (CollisionChecker* one : {&checker, &plain}) {
      REQUIRE(one->set_robot(robot.rig.desc(), robot.body.desc()) == Status::kOk);
      one->world().job().margin = seed % 3 == 0 ? 0.1f : 0.0f;
    }
    // Points between two fixed bodies, so that numbers are counted over both.
    const ConvexPart ball = {ShapeKind::kSphere, {0, 0, 0}, {0, 0, 0, 1}, {radius, 0, 0}, {}};
    const Leaf leaf = {0, axis_aligned_box({0, 0, 0}, {radius, radius, radius}), {&ball, 1}};
    ArticulationDesc one_ball;
    one_ball.link_parents = kOneLink;
    one_ball.leaves = {&leaf, 1};
    std::vector<std::array<float, 7>> poses(point_count);
    REQUIRE(checker.add_points(points, radius) == Status::kOk);
    REQUIRE(checker.add_fixed(around.desc(), around_poses) == Status::kOk);
    REQUIRE(plain.add_fixed(around.desc(), around_poses) == Status::kOk);
    for (std::uint32_t i = 0; i < point_count; ++i) {
      poses[i] = {0, 0, 0, 1, points[3 * i], points[3 * i + 1], points[3 * i + 2]};
      REQUIRE(plain.add_fixed(one_ball, poses[i]) == Status::kOk);
    }
    std::vector<StateAnswer> answers(count), expected(count);
    REQUIRE(checker.check(states, answers) == Status::kOk);
    REQUIRE(plain.check(states, expected) == Status::kOk);
    CHECK(answers == expected);
    for (const StateAnswer answer : answers) ++(answer == StateAnswer::kFree ? free : colliding);

    // State, links, and what the second one is of: -1, 0 for the body, 1 and more for a point.
    using Row = std::array<std::int64_t, 4>;
    const std::uint32_t tested = std::min(checker.chunk(), static_cast<std::uint32_t>(count));
    const Span<const double> first = {states.data(), tested * robot.body.variable_count};
    REQUIRE(checker.find_hits(first, tested) == Status::kOk);
    REQUIRE(plain.find_hits(first, tested) == Status::kOk);
    std::vector<Row> rows, right;
    for (const Hit& hit : checker.world().hits()) {
      const std::int32_t fixed = checker.fixed_of(hit);
      hit_points += fixed == 0;
      const std::int64_t of = fixed < 0 ? -1 : fixed == 1 ? 0 : std::int64_t{1} + hit.instance_b;
      rows.push_back({hit.instance_a, hit.link_a, fixed == 0 ? 0 : hit.link_b, of});
    }
    for (const Hit& hit : plain.world().hits())
      right.push_back({hit.instance_a, hit.link_a, hit.link_b, plain.fixed_of(hit)});
    std::sort(rows.begin(), rows.end());
    std::sort(right.begin(), right.end());
    CHECK(rows == right);
  }
  CHECK(colliding >= least_count(200, 25));
  CHECK(free >= least_count(50, 25));
  CHECK(hit_points >= least_count(100, 25));
}

TEST_CASE("links with padding touch what stands around where plain ones come as near, and each other as before") {
  std::size_t near = 0, apart = 0, own = 0, free_ways = 0;
  for (std::uint64_t seed = 1; seed <= rounds(40); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    const bool is_round = seed % 2 == 0;
    const ShapedRig robot(random, is_round);
    const std::size_t links = robot.rig.body.parents.size(), variables = robot.rig.body.variable_count;
    const std::vector<double> states = random_states(random, robot.rig, 64);
    std::vector<float> padding, poses, points;
    for (std::size_t l = 0; l < links; ++l)
      padding.push_back(random.chance(0.3) ? 0.0f : static_cast<float>(random.log_uniform(0.01, 0.3)));
    const float largest = *std::max_element(padding.begin(), padding.end());
    const Rig around = random_fixed(random, poses);
    for (int i = 0; i < 30; ++i) points.push_back(static_cast<float>(random.normal()));
    CollisionChecker checker, plain;
    for (CollisionChecker* one : {&checker, &plain}) {
      REQUIRE(one->set_robot(robot.rig.rig.desc(), robot.rig.body.desc()) == Status::kOk);
      if (one == &checker) REQUIRE(one->set_padding(robot.rig.rig.desc(), padding) == Status::kOk);
      if (seed % 3 == 0) REQUIRE(one->add_points(points, 0.05f) == Status::kOk);
      REQUIRE(one->add_fixed(around.desc(), poses) == Status::kOk);
      if (seed % 3 == 1) REQUIRE(one->add_points(points, 0.05f) == Status::kOk);
      one->world().want_contacts();
    }
    // State, link, what it touches and which link or point of it, with the distance.
    using Pair = std::array<std::int64_t, 4>;
    const auto pairs_of = [&](CollisionChecker& of, float margin) {
      std::map<Pair, double> out;
      of.world().job().margin = margin;
      REQUIRE(of.find_hits(states, 64) == Status::kOk);
      of.world().job().margin = 0;
      for (std::size_t h = 0; h < of.world().hits().size; ++h) {
        const Hit& hit = of.world().hits()[h];
        const std::int32_t fixed = of.fixed_of(hit);
        const bool is_point = fixed >= 0 && fixed == (seed % 3 == 0 ? 0 : 1);
        out[{hit.instance_a, hit.link_a, fixed, is_point ? hit.instance_b : hit.link_b}] =
            -double{of.world().contacts()[h].depth};
      }
      return out;
    };
    const std::map<Pair, double> padded = pairs_of(checker, 0), touching = pairs_of(plain, 0),
                                 within = pairs_of(plain, 1.8f * largest);
    std::vector<StateAnswer> answers(64), expected(64, StateAnswer::kFree);
    std::vector<double> nearest(64, std::numeric_limits<double>::infinity());
    for (const auto& [pair, distance] : padded) expected[static_cast<std::size_t>(pair[0])] = StateAnswer::kColliding;
    REQUIRE(checker.check(states, answers) == Status::kOk);
    CHECK(answers == expected);

    for (const auto& [pair, distance] : touching)
      if (pair[2] < 0) {
        ++own;
        REQUIRE(padded.count(pair) == 1);
        CHECK(padded.at(pair) == distance);
      }
    for (const auto& [pair, distance] : within) {
      const double by = pair[2] < 0 ? 0 : padding[static_cast<std::size_t>(pair[1])];
      double& least = nearest[static_cast<std::size_t>(pair[0])];
      least = std::min(least, distance - by);
      if (pair[2] < 0) continue;
      if (distance <= by - 1e-6) {
        near += distance > 0;
        REQUIRE(padded.count(pair) == 1);
        CHECK(padded.at(pair) <= distance - by + 1e-5);
      } else if (distance > by * (is_round ? 1 : 1.74) + 1e-5) {
        ++apart;
        CHECK(padded.count(pair) == 0);
      }
    }
    for (const auto& [pair, distance] : padded) {
      CHECK(within.count(pair) == 1);
      if (pair[2] < 0) CHECK(touching.count(pair) == 1);
    }
    if (is_round) {
      std::vector<NearestLinks> found(64);
      REQUIRE(checker.find_nearest(states, found, 0.5f * largest) == Status::kOk);
      for (std::size_t i = 0; i < 64; ++i)
        if (nearest[i] <= 0.5 * double{largest} - 1e-5)
          CHECK(double{found[i].distance} == doctest::Approx(nearest[i]).epsilon(1e-4).scale(1));
    }
    // Ways that are called free: 17 states on each.
    std::vector<MotionAnswer> ways(32);
    MotionSearch search;
    REQUIRE(checker.check_motions({states.data(), 32 * variables}, {states.data() + 32 * variables, 32 * variables},
                                  ways, search) == Status::kOk);
    for (std::size_t w = 0; w < 32; ++w) {
      if (ways[w] != MotionAnswer::kFree) continue;
      ++free_ways;
      std::vector<double> between;
      for (int i = 0; i <= 16; ++i)
        for (std::size_t v = w * variables; v < (w + 1) * variables; ++v)
          between.push_back(states[v] + i / 16. * (states[v + 32 * variables] - states[v]));
      std::vector<StateAnswer> on_way(17);
      REQUIRE(checker.check(between, on_way) == Status::kOk);
      CHECK(std::count(on_way.begin(), on_way.end(), StateAnswer::kFree) == 17);
    }
  }
  CHECK(near >= least_count(60, 40));
  CHECK(apart >= least_count(200, 40));
  CHECK(own >= least_count(50, 40));
  CHECK(free_ways >= least_count(50, 40));
}

TEST_CASE(
    "a motion in which a padded corner just passes a ball is not free, and a pose that only padding masks is told") {
  Plain plain;
  plain.body.links[0].joint_count = 1;
  plain.body.joints.resize(1);
  plain.leaf.box = axis_aligned_box({0, 0, 0}, {.05f, .05f, .05f});
  // The corner, 1.485 from the axis, meets the ball in the middle of a quarter turn, within 1e-4 radians.
  CollisionChecker turning;
  const float padding = 1, radius = 0.05f;
  REQUIRE(turning.set_robot(plain.desc, plain.body.desc()) == Status::kOk);
  REQUIRE(turning.set_padding(plain.desc, {&padding, 1}) == Status::kOk);
  const ConvexPart ball = {ShapeKind::kSphere, {0, 0, 0}, {0, 0, 0, 1}, {radius, 0, 0}, {}};
  const Leaf leaf = {0, axis_aligned_box({0, 0, 0}, {radius, radius, radius}), {&ball, 1}};
  ArticulationDesc one_ball;
  one_ball.link_parents = kOneLink;
  one_ball.leaves = {&leaf, 1};
  const float pose[] = {0, 0, 0, 1, 0, static_cast<float>(1.05 * std::sqrt(2.) + 0.05 - 1e-4), 0};
  REQUIRE(turning.add_fixed(one_ball, pose) == Status::kOk);
  const double from = 0, to = std::acos(0.);
  MotionAnswer answer = MotionAnswer::kFree;
  MotionSearch search;
  REQUIRE(turning.check_motions({&from, 1}, {&to, 1}, {&answer, 1}, search) == Status::kOk);
  CHECK(answer != MotionAnswer::kFree);

  plain.body.joints[0].kind = JointKind::kPrismatic;
  CollisionChecker sliding;
  const float large = 9e17f;
  REQUIRE(sliding.set_robot(plain.desc, plain.body.desc()) == Status::kOk);
  REQUIRE(sliding.set_padding(plain.desc, {&large, 1}) == Status::kOk);
  REQUIRE(sliding.add_fixed(one_ball, pose) == Status::kOk);
  StateAnswer state = StateAnswer::kNotTested;
  REQUIRE(sliding.check({&from, 1}, {&state, 1}) == Status::kOk);
  CHECK(state == StateAnswer::kColliding);
  sliding.world().job().margin = 5e17f;
  REQUIRE(sliding.check({&from, 1}, {&state, 1}) == Status::kOk);
  CHECK(state == StateAnswer::kNotTested);
}

TEST_CASE("padding is set once, after the robot and before what stands around, by one length per link") {
  const Plain plain;
  CollisionChecker checker;
  const float padding[] = {0.25f, 0.25f}, negative = -1;
  const Span<const float> one = {padding, 1};
  CHECK(checker.set_padding(plain.desc, one) == Status::kUnknownBatch);
  REQUIRE(checker.set_robot(plain.desc, plain.body.desc()) == Status::kOk);
  CHECK(checker.set_padding(plain.desc, padding) == Status::kBadMargin);
  CHECK(checker.set_padding(plain.desc, {&negative, 1}) == Status::kBadMargin);
  CHECK(checker.set_padding(plain.desc, {}) == Status::kBadMargin);
  const std::int32_t parents[] = {-1, 0};
  ArticulationDesc other = plain.desc;
  other.link_parents = parents;
  CHECK(checker.set_padding(other, padding) == Status::kBadJoint);
  // Neither another robot, nor spans without data.
  ArticulationDesc bad = plain.desc;
  bad.leaves = {};
  CHECK(checker.set_padding(bad, one) == Status::kBadJoint);
  Leaf leaf = plain.leaf;
  leaf.box.half[0] *= 1.5f;
  bad.leaves = {&leaf, 1};
  CHECK(checker.set_padding(bad, one) == Status::kBadJoint);
  leaf.parts = {nullptr, 1};
  CHECK(checker.set_padding(bad, one) == Status::kBadShape);
  ConvexPart part;
  part.vertices = {nullptr, 9};
  leaf.parts = {&part, 1};
  CHECK(checker.set_padding(bad, one) == Status::kBadShape);
  bad.leaves = {nullptr, 1};
  CHECK(checker.set_padding(bad, one) == Status::kBadShape);
  REQUIRE(checker.set_padding(plain.desc, one) == Status::kOk);
  CHECK(checker.set_padding(plain.desc, one) == Status::kBatchGivenTwice);
  const float pose[] = {0, 0, 0, 1, 0, 0, 1.2f};
  REQUIRE(checker.add_fixed(plain.desc, pose) == Status::kOk);
  const double state = 0;
  StateAnswer answer = StateAnswer::kNotTested;
  REQUIRE(checker.check({&state, 1}, {&answer, 1}) == Status::kOk);
  CHECK(answer == StateAnswer::kColliding);
  CollisionChecker late;
  REQUIRE(late.set_robot(plain.desc, plain.body.desc()) == Status::kOk);
  REQUIRE(late.add_fixed(plain.desc, pose) == Status::kOk);
  CHECK(late.set_padding(plain.desc, one) == Status::kBatchGivenTwice);
}

TEST_CASE("points that are none are refused, and answers stay as they were") {
  const Plain plain;
  CollisionChecker checker;
  const float points[] = {0, 0, 0, 9, 9, 9};
  CHECK(checker.add_points(points, 0.1f) == Status::kUnknownBatch);
  REQUIRE(checker.set_robot(plain.desc, plain.body.desc()) == Status::kOk);
  CHECK(checker.add_points({points, 5}, 0.1f) == Status::kBadStaticBody);
  CHECK(checker.add_points({nullptr, 3}, 0.1f) == Status::kBadStaticBody);
  for (const float bad : {0.0f, -1.0f, 6e17f, HUGE_VALF, std::nanf("")})
    CHECK(checker.add_points(points, bad) == Status::kBadShape);
  float bad_points[] = {0, 0, 0, 1, 1, 1, 2, 2, 2};
  for (const float bad : {HUGE_VALF, std::nanf("")}) {
    std::uint32_t bad_point = 0;
    bad_points[7] = bad;
    CHECK(checker.add_points(bad_points, 0.1f, &bad_point) == Status::kBadStaticBody);
    CHECK(bad_point == 2);
  }
  CHECK(checker.add_points({points, 3 * (std::size_t{kMaxInstances} + 1)}, 0.1f) == Status::kTooManyInstances);
  CHECK(checker.add_points({points, 0}, 0.1f) == Status::kNoInstances);
  const double state = 0;
  StateAnswer answer = StateAnswer::kNotTested;
  REQUIRE(checker.check({&state, 1}, {&answer, 1}) == Status::kOk);
  CHECK(answer == StateAnswer::kFree);
  REQUIRE(checker.add_points({points + 3, 3}, 0.1f) == Status::kOk);
  REQUIRE(checker.check({&state, 1}, {&answer, 1}) == Status::kOk);
  CHECK(answer == StateAnswer::kFree);
  REQUIRE(checker.add_points({points, 3}, 0.1f) == Status::kOk);
  REQUIRE(checker.check({&state, 1}, {&answer, 1}) == Status::kOk);
  CHECK(answer == StateAnswer::kColliding);
}

TEST_CASE("a robot of more links than a chunk of states has room for takes motions by the chunk") {
  // A row of boxes that one joint moves.
  constexpr std::uint32_t kLinks = 700;
  JointedBody body;
  std::vector<Leaf> leaves;
  body.variable_count = 1;
  for (std::uint32_t l = 0; l < kLinks; ++l) {
    body.parents.push_back(static_cast<std::int32_t>(l) - 1);
    LinkPlaceDesc& place = body.links.emplace_back();
    place.translation[0] = l > 0 ? 1 : 0;
    leaves.push_back({l, axis_aligned_box({0, 0, 0}, {.1f, .1f, .1f}), {}});
  }
  body.links[0].joint_count = 1;
  body.joints.resize(1);
  body.joints[0].kind = JointKind::kPrismatic;
  ArticulationDesc desc;
  desc.link_parents = body.parents;
  desc.leaves = leaves;
  CollisionChecker checker;
  REQUIRE(checker.set_robot(desc, body.desc()) == Status::kOk);
  CHECK(checker.chunk() >= 64);
  CHECK(checker.chunk() % 16 == 0);
  const std::vector<double> from(100, 0), to(100, 1);
  std::vector<MotionAnswer> answers(100, MotionAnswer::kNotTested);
  MotionSearch search;
  REQUIRE(checker.check_motions(from, to, answers, search) == Status::kOk);
  CHECK(answers == std::vector<MotionAnswer>(100, MotionAnswer::kFree));
}

TEST_CASE("a checker refuses what it cannot take, and stays as it was") {
  const Plain plain;
  const KinematicsDesc kinematics = plain.body.desc();
  CollisionChecker checker;
  const double state = 0;
  StateAnswer answer = StateAnswer::kNotTested;
  CHECK(checker.check({&state, 1}, {&answer, 1}) == Status::kUnknownBatch);
  CHECK(checker.add_fixed(plain.desc, kPose) == Status::kUnknownBatch);
  CHECK(checker.set_robot(plain.desc, {}) == Status::kNoLinks);
  JointedBody two = plain.body;
  two.parents = {-1, 0};
  two.links.resize(2);
  CHECK(checker.set_robot(plain.desc, two.desc()) == Status::kBadJoint);
  ArticulationDesc none = plain.desc;
  none.leaves = {};
  CHECK(checker.set_robot(none, kinematics) == Status::kNoLeaves);
  Plain bad;
  bad.leaf.box.half[1] = -1;
  std::uint32_t leaf = 7;
  CHECK(checker.set_robot(bad.desc, kinematics, &leaf) == Status::kBadLeafBox);
  CHECK(leaf == 0);
  REQUIRE(checker.set_robot(plain.desc, kinematics) == Status::kOk);
  CHECK(checker.set_robot(plain.desc, kinematics) == Status::kBatchGivenTwice);

  CHECK(checker.add_fixed(plain.desc, {kPose, 6}) == Status::kBadPoses);
  CHECK(checker.add_fixed(plain.desc, {nullptr, 7}) == Status::kBadPoses);
  const float no_pose[7] = {};
  CHECK(checker.add_fixed(plain.desc, no_pose) == Status::kBadPoses);
  CHECK(checker.world().inputs().size == 1);
  CHECK(checker.world().rules().size == 1);

  CHECK(checker.check({&state, 0}, {&answer, 1}) == Status::kBadOutput);
  CHECK(checker.check({nullptr, 1}, {&answer, 1}) == Status::kBadOutput);
  CHECK(checker.check({&state, 1}, {nullptr, 1}) == Status::kBadOutput);
  CHECK(checker.find_hits({&state, 1}, checker.chunk() + 1) == Status::kBadCount);
  CHECK(checker.find_hits({&state, 1}, 2) == Status::kBadOutput);
  CHECK(checker.flags().empty());
  CHECK(checker.check({}, {}) == Status::kOk);
  CHECK(checker.check({&state, 1}, {&answer, 1}) == Status::kOk);
  CHECK(answer == StateAnswer::kFree);

  EngineDesc nowhere;
  nowhere.isa = static_cast<Isa>(kIsaCount + 1);
  CollisionChecker without(nowhere);
  CHECK(without.status() == Status::kIsaNotAvailable);
  CHECK(without.set_robot(plain.desc, kinematics) == Status::kIsaNotAvailable);
  CHECK(without.check({}, {}) == Status::kIsaNotAvailable);
}

}  // namespace cab::tests
