// CollisionChecker: the answers of the plain calls, for any number of states, and a status for every misuse.
#include <cab/collision_checker.h>

#include "perf/harness/random_joints.h"
#include "perf/harness/random_rig.h"
#include "perf/harness/world.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
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
  CHECK(colliding > least_count(500, 40));
  CHECK(free > least_count(500, 40));
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
  CHECK(colliding > least_count(200, 25));
  CHECK(free > least_count(50, 25));
  CHECK(hit_points > least_count(100, 25));
}

TEST_CASE("points that are none are refused, and answers stay as they were") {
  const Plain plain;
  CollisionChecker checker;
  const float points[] = {0, 0, 0, 9, 9, 9};
  CHECK(checker.add_points(points, 0.1f) == Status::kUnknownBatch);
  REQUIRE(checker.set_robot(plain.desc, plain.body.desc()) == Status::kOk);
  CHECK(checker.add_points({points, 5}, 0.1f) == Status::kBadStaticBody);
  CHECK(checker.add_points({nullptr, 3}, 0.1f) == Status::kBadStaticBody);
  CHECK(checker.add_points(points, 0) == Status::kBadShape);
  const float nan[] = {0, std::numeric_limits<float>::quiet_NaN(), 0};
  CHECK(checker.add_points(nan, 0.1f) == Status::kBadStaticBody);
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
