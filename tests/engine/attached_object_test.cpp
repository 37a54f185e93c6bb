// Objects that a robot holds: the answers of a checker beside those for a body of its own at the poses of the link, and
// beside those for a robot that has the object as a link by hand.
#include <cab/attached_object.h>
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

// Poses of the object are rounded once in a checker and twice here: by how much depths differ, and how deep hits are
// that are in one of the two alone. The most in 400 rounds was 4.4e-7, and no hit.
constexpr double kRounding = 2e-6;

// Leaves of an object with shapes of several kinds, and who holds it where.
struct Held {
  std::vector<Leaf> leaves;
  std::vector<ConvexPart> parts;
  std::vector<float> vertices;
  std::vector<std::uint32_t> touch;
  AttachedDesc desc;

  // links: how many the robot has.
  Held(Random& random, std::uint32_t links) {
    for (int l = 0; l < 3; ++l)
      leaves.push_back({0, random_box(random, random.uniform(0, 0.4) * random.unit_vector(), 0.05, 0.4), {}});
    parts.resize(2);
    vertices.resize(36);
    for (std::size_t p = 0; p < 2; ++p) {
      const Box& box = leaves[p].box;
      std::copy_n(box.center, 3, parts[p].position);
      parts[p].size[0] = std::min({box.half[0], box.half[1], box.half[2]});
      leaves[p].parts = {&parts[p], 1};
    }
    parts[0].kind = ShapeKind::kSphere;
    parts[1].kind = ShapeKind::kConvexHull;
    for (float& x : vertices) x = static_cast<float>(random.uniform(-0.57, 0.57)) * parts[1].size[0];
    parts[1].vertices = vertices;
    desc.link = random.index(links);
    for (double& x : desc.rotation) x = random.uniform(-1, 1);
    for (double& x : desc.translation) x = random.uniform(-0.3, 0.3);
    for (unsigned t = random.index(3); t > 0; --t) touch.push_back(random.index(links));
    desc.leaves = leaves;
    desc.touch_links = touch;
  }
  Held(const Held&) = delete;
  Held& operator=(const Held&) = delete;

  bool may_touch(std::uint32_t link) const {
    return link == desc.link || std::find(touch.begin(), touch.end(), link) != touch.end();
  }
};

std::vector<double> random_states(Random& random, const JointedBody& body, std::size_t count) {
  std::vector<double> states(count * body.variable_count);
  for (double& x : states) x = random.uniform(-3, 3);
  return states;
}

Rig random_table(Random& random, std::vector<float>& pose) {
  double q[4];
  random_turn(random, q);
  pose.resize(7);
  write_pose(PoseFormat::kQuaternionTranslation, q, random.uniform(0.5, 1) * random.unit_vector(), pose.data());
  Rig table;
  table.parents = {-1};
  for (int l = 0; l < 2; ++l) table.leaves.push_back({0, random_box(random, {}, 0.1, 0.6), {}});
  return table;
}

// Writes a times b of poses x y z w and translation.
template <class T>
void times(const float* a, const T* rotation, const T* translation, float* out) {
  const double q[4] = {a[0], a[1], a[2], a[3]}, p[4] = {rotation[0], rotation[1], rotation[2], rotation[3]};
  double column[3][3];
  quaternion_matrix(q, column);
  for (std::size_t c = 0; c < 3; ++c) {
    double x = a[4 + c];
    for (std::size_t k = 0; k < 3; ++k) x += column[k][c] * translation[k];
    out[4 + c] = static_cast<float>(x);
  }
  out[0] = static_cast<float>(q[3] * p[0] + q[0] * p[3] + q[1] * p[2] - q[2] * p[1]);
  out[1] = static_cast<float>(q[3] * p[1] + q[1] * p[3] + q[2] * p[0] - q[0] * p[2]);
  out[2] = static_cast<float>(q[3] * p[2] + q[2] * p[3] + q[0] * p[1] - q[1] * p[0]);
  out[3] = static_cast<float>(q[3] * p[3] - q[0] * p[0] - q[1] * p[1] - q[2] * p[2]);
}

// State, link of the robot, whether the other is of the table, link of the other. Depths of what touches.
using Row = std::array<std::uint32_t, 4>;
using Rows = std::map<Row, double>;

Rows rows_of(CollisionChecker& checker, const std::vector<double>& states, std::uint32_t count) {
  checker.world().want_contacts();
  REQUIRE(checker.find_hits(states, count) == Status::kOk);
  Rows rows;
  for (std::size_t h = 0; h < checker.world().hits().size; ++h) {
    const Hit& hit = checker.world().hits()[h];
    rows[{hit.instance_a, hit.link_a, checker.fixed_of(hit) < 0 ? 0u : 1u, hit.link_b}] =
        double{checker.world().contacts()[h].depth};
  }
  return rows;
}

// The same by plain calls: the object is a body of its own, posed by the poses of the robot's link.
Rows rows_by_hand(const JointedRig& robot, const Held& held, const Rig& table, const std::vector<float>& table_pose,
                  const std::vector<double>& states) {
  const std::size_t links = robot.body.parents.size(), count = states.size() / robot.body.variable_count;
  oracle::World world;
  world.members.resize(3);
  for (Member& member : world.members) {
    member.kind = BatchKind::kSequence;
    member.poses.link_count = 1;
    member.poses.instance_count = static_cast<std::uint32_t>(count);
  }
  Member &of_robot = world.members[0], &of_object = world.members[1], &of_table = world.members[2];
  of_robot.rig = robot.rig;
  of_robot.poses.link_count = robot.rig.link_count();
  of_robot.poses.data.resize(7 * links * count);
  REQUIRE(compute_link_poses(robot.body.desc(), states, Isa::kScalar, of_robot.poses.data) == Status::kOk);
  of_object.rig.parents = {-1};
  of_object.rig.leaves = held.leaves;
  of_object.poses.data.resize(7 * count);
  for (std::size_t i = 0; i < count; ++i)
    times(&of_robot.poses.data[7 * (i * links + held.desc.link)], held.desc.rotation, held.desc.translation,
          &of_object.poses.data[7 * i]);
  of_table.rig = table;
  of_table.poses.instance_count = 1;
  of_table.poses.data = table_pose;
  world.rules = {{{1}, {1}, Pairing::kWithin},
                 {{1}, {2}, Pairing::kBetween},
                 {{1}, {3}, Pairing::kBetween},
                 {{2}, {3}, Pairing::kBetween}};
  world.contacts = true;
  Policies policies;
  policies.exact = Exact::kConvex;
  const Outcome outcome = run_world(world, policies);
  Rows rows;
  for (std::size_t h = 0; h < outcome.hits.size(); ++h) {
    const Hit& hit = outcome.hits[h];
    const bool is_object_a = hit.batch_a.value == 2, is_object_b = hit.batch_b.value == 2;
    if (is_object_b && held.may_touch(hit.link_a)) continue;
    const auto object = static_cast<std::uint32_t>(links);
    rows[{hit.instance_a, is_object_a ? object : hit.link_a, hit.batch_b.value == 3 ? 1u : 0u,
          is_object_b ? object : hit.link_b}] = double{outcome.contacts[h].depth};
  }
  return rows;
}

}  // namespace

TEST_CASE("a held object touches what a body at the poses of its link touches, but for the links that may") {
  std::size_t with_links = 0, with_table = 0, free_ways = 0, free_of_object = 0;
  for (std::uint64_t seed = 1; seed <= rounds(40); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    const JointedRig robot = random_jointed_rig(random, 7, 2, 0.5);
    const std::uint32_t links = robot.rig.link_count(), variables = robot.body.variable_count;
    const Held held(random, links);
    std::vector<float> table_pose;
    const Rig table = random_table(random, table_pose);
    AttachedObject attached;
    REQUIRE(attached.set(robot.rig.desc(), robot.body.desc(), held.desc) == Status::kOk);
    CollisionChecker checker;
    REQUIRE(checker.set_robot(attached.desc(), attached.kinematics()) == Status::kOk);
    REQUIRE(checker.add_fixed(table.desc(), table_pose) == Status::kOk);

    const std::vector<double> states = random_states(random, robot.body, 64);
    const Rows rows = rows_of(checker, states, 64), expected = rows_by_hand(robot, held, table, table_pose, states);
    for (const auto& [from, to] : {std::make_pair(&rows, &expected), std::make_pair(&expected, &rows)})
      for (const auto& [row, depth] : *from)
        if (depth > kRounding) {
          REQUIRE(to->count(row) == 1);
          CHECK(std::fabs(to->at(row) - depth) < kRounding);
        }
    std::vector<StateAnswer> answers(64), colliding(64, StateAnswer::kFree);
    for (const auto& [row, depth] : rows) {
      if (row[3] == links && row[2] == 0) {
        ++with_links;
        CHECK(!held.may_touch(row[1]));
      }
      with_table += row[1] == links;
      colliding[row[0]] = StateAnswer::kColliding;
    }
    REQUIRE(checker.check(states, answers) == Status::kOk);
    CHECK(answers == colliding);

    // Ways that are called free: 9 states on each.
    std::vector<double> from, to, between;
    for (std::size_t i = 0; i < 32 * variables; ++i) {
      from.push_back(states[i]);
      to.push_back(states[i] + random.uniform(-0.3, 0.3));
    }
    std::vector<MotionAnswer> ways(32);
    MotionSearch search;
    REQUIRE(checker.check_motions(from, to, ways, search) == Status::kOk);
    std::size_t free = 0;
    for (std::size_t w = 0; w < 32; ++w) {
      if (ways[w] != MotionAnswer::kFree) continue;
      ++free;
      for (int i = 0; i <= 8; ++i)
        for (std::size_t v = w * variables; v < (w + 1) * variables; ++v)
          between.push_back(from[v] + i / 8. * (to[v] - from[v]));
    }
    if (free > 0) CHECK(rows_by_hand(robot, held, table, table_pose, between).empty());
    free_ways += free;
    // That of the robot alone is free more often.
    CollisionChecker alone;
    REQUIRE(alone.set_robot(robot.rig.desc(), robot.body.desc()) == Status::kOk);
    REQUIRE(alone.add_fixed(table.desc(), table_pose) == Status::kOk);
    REQUIRE(alone.check_motions(from, to, ways, search) == Status::kOk);
    free_of_object += static_cast<std::size_t>(std::count(ways.begin(), ways.end(), MotionAnswer::kFree)) - free;
  }
  CHECK(with_links >= least_count(200, 40));
  CHECK(with_table >= least_count(100, 40));
  CHECK(free_ways >= least_count(300, 40));
  CHECK(free_of_object >= least_count(100, 40));
}

TEST_CASE("two held objects answer as links that are given by hand, with padding, among bodies and points") {
  std::size_t hits = 0, of_objects = 0;
  for (std::uint64_t seed = 1; seed <= rounds(20); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    const JointedRig robot = random_jointed_rig(random, 7, 2, 0.4);
    const std::uint32_t links = robot.rig.link_count(), variables = robot.body.variable_count;
    const Held first(random, links), second(random, links + 1);
    std::vector<float> table_pose, points, padding;
    const Rig table = random_table(random, table_pose);
    for (int i = 0; i < 60; ++i) points.push_back(static_cast<float>(random.normal()));
    for (std::uint32_t l = 0; l < links + 2; ++l) padding.push_back(static_cast<float>(random.uniform(0, 0.1)));

    // Set twice, so that the second one reads what it replaces.
    AttachedObject attached;
    REQUIRE(attached.set(robot.rig.desc(), robot.body.desc(), first.desc) == Status::kOk);
    REQUIRE(attached.set(attached.desc(), attached.kinematics(), second.desc) == Status::kOk);
    CHECK(attached.desc().link_parents.size == links + 2);
    JointedRig by_hand = robot;
    for (const Held* held : {&first, &second}) {
      const auto number = by_hand.rig.link_count();
      by_hand.body.parents.push_back(static_cast<std::int32_t>(held->desc.link));
      LinkPlaceDesc& place = by_hand.body.links.emplace_back();
      double n = 0;
      for (const double x : held->desc.rotation) n += x * x;
      for (std::size_t c = 0; c < 4; ++c) place.rotation[c] = held->desc.rotation[c] / std::sqrt(n);
      std::copy_n(held->desc.translation, 3, place.translation);
      by_hand.rig.parents = by_hand.body.parents;
      if (!by_hand.rig.joints.empty()) by_hand.rig.joints.insert(by_hand.rig.joints.end(), {0, 0, 0});
      for (Leaf leaf : held->leaves) {
        leaf.link = number;
        by_hand.rig.leaves.push_back(leaf);
      }
      for (std::uint32_t l = 0; l < number; ++l)
        if (held->may_touch(l)) by_hand.rig.ignored.push_back({number, l});
    }
    CollisionChecker checker, plain;
    for (CollisionChecker* one : {&checker, &plain}) {
      const bool is_plain = one == &plain;
      const ArticulationDesc desc = is_plain ? by_hand.rig.desc() : attached.desc();
      REQUIRE(one->set_robot(desc, is_plain ? by_hand.body.desc() : attached.kinematics()) == Status::kOk);
      if (seed % 2 == 0) REQUIRE(one->set_padding(desc, padding) == Status::kOk);
      REQUIRE(one->add_fixed(table.desc(), table_pose) == Status::kOk);
      if (seed % 3 == 0) REQUIRE(one->add_points(points, 0.05f) == Status::kOk);
    }
    const std::vector<double> states = random_states(random, robot.body, 64);
    REQUIRE(checker.find_hits(states, 64) == Status::kOk);
    REQUIRE(plain.find_hits(states, 64) == Status::kOk);
    std::vector<Hit> found[2];
    for (const Hit& hit : checker.world().hits()) {
      found[0].push_back(hit);
      of_objects += hit.link_a >= links;
    }
    for (const Hit& hit : plain.world().hits()) found[1].push_back(hit);
    CHECK(same_hits(found[0], found[1]));
    hits += found[0].size();

    std::vector<NearestLinks> nearest[2];
    std::vector<double> slopes[2];
    std::vector<MotionAnswer> ways[2];
    for (CollisionChecker* one : {&checker, &plain}) {
      const std::size_t k = one == &plain;
      nearest[k].resize(64);
      slopes[k].resize(64 * variables);
      ways[k].resize(32);
      MotionSearch search;
      REQUIRE(one->find_nearest(states, nearest[k], 0.5f, slopes[k]) == Status::kOk);
      REQUIRE(one->check_motions({states.data(), 32 * variables}, {states.data() + 32 * variables, 32 * variables},
                                 ways[k], search) == Status::kOk);
    }
    for (std::size_t i = 0; i < 64; ++i) {
      CHECK(nearest[0][i].link_a == nearest[1][i].link_a);
      CHECK(nearest[0][i].link_b == nearest[1][i].link_b);
      if (std::isinf(nearest[1][i].distance))
        CHECK(std::isinf(nearest[0][i].distance));
      else
        CHECK(nearest[0][i].distance == doctest::Approx(nearest[1][i].distance).epsilon(1e-5).scale(1));
    }
    for (std::size_t i = 0; i < slopes[0].size(); ++i) CHECK(slopes[0][i] == doctest::Approx(slopes[1][i]).scale(1));
    CHECK(ways[0] == ways[1]);
  }
  CHECK(hits >= least_count(500, 20));
  CHECK(of_objects >= least_count(200, 20));
}

TEST_CASE("an object that cannot be held is refused by what is wrong with it, and nothing changes") {
  const std::int32_t parents[] = {-1, 0}, later[] = {-1, 1};
  std::vector<LinkPlaceDesc> places(2);
  const Leaf leaf = {1, {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {1, 1, 1}}, {}};
  const Leaf ball = {0, leaf.box, {}};
  const LinkPair pair = {0, 1}, no_pair = {0, 2};
  const float pose[14] = {0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0}, joints[6] = {};
  const std::uint32_t touch[] = {0}, no_link[] = {2};
  struct Case {
    ArticulationDesc robot;
    KinematicsDesc kinematics;
    AttachedDesc object;
  };
  Case right;
  right.robot = {parents, joints, {&leaf, 1}, {&pair, 1}, 1};
  right.kinematics = {parents, places, {}, 0};
  right.object.link = 1;
  right.object.leaves = {&ball, 1};
  right.object.touch_links = touch;
  AttachedObject attached;
  CHECK(attached.desc().link_parents.empty());
  CHECK(attached.kinematics().links.empty());
  REQUIRE(attached.set(right.robot, right.kinematics, right.object) == Status::kOk);
  CHECK(attached.desc().link_joints.size == 9);
  for (int c = 6; c < 9; ++c) CHECK(attached.desc().link_joints[static_cast<std::size_t>(c)] == 0);

  const double nan = std::numeric_limits<double>::quiet_NaN(), infinite = std::numeric_limits<double>::infinity();
  const std::vector<std::int32_t> chain(kMaxLinks, -1);
  const std::vector<Leaf> many(kMaxLeaves, ball);
  const auto refused = [&](Status status, auto change) {
    Case wrong = right;
    change(wrong);
    CHECK(attached.set(wrong.robot, wrong.kinematics, wrong.object) == status);
    CHECK(attached.desc().link_parents.size == 3);
    CHECK(attached.desc().leaves.size == 2);
    CHECK(attached.desc().leaves[1].link == 2);
    CHECK(attached.kinematics().links.size == 3);
  };
  refused(Status::kNoLinks, [](Case& of) { of.robot.link_parents = {}; });
  refused(Status::kTooManyLinks, [&](Case& of) { of.robot.link_parents = chain; });
  refused(Status::kBadParent, [](Case& of) { of.object.link = 2; });
  refused(Status::kBadParent, [](Case& of) { of.robot.link_parents.data = nullptr; });
  refused(Status::kBadParent, [&](Case& of) { of.robot.link_parents = later; });
  refused(Status::kBadJoint, [](Case& of) { of.kinematics.link_parents.size = 1; });
  refused(Status::kBadJoint, [](Case& of) { of.kinematics.link_parents.data = nullptr; });
  refused(Status::kBadJoint, [&](Case& of) { of.kinematics.link_parents = {chain.data(), 2}; });
  refused(Status::kBadJoint, [](Case& of) { of.kinematics.links.size = 3; });
  refused(Status::kBadJoint, [](Case& of) { of.kinematics.links.data = nullptr; });
  refused(Status::kBadJoint, [](Case& of) { of.robot.link_joints.size = 3; });
  refused(Status::kBadJoint, [](Case& of) { of.robot.link_joints.data = nullptr; });
  refused(Status::kNoLeaves, [](Case& of) { of.object.leaves = {}; });
  refused(Status::kNoLeaves, [](Case& of) { of.object.leaves.data = nullptr; });
  refused(Status::kNoLeaves, [](Case& of) { of.robot.leaves.data = nullptr; });
  refused(Status::kTooManyLeaves, [&](Case& of) { of.object.leaves = many; });
  refused(Status::kTooManyLeaves, [](Case& of) { of.robot.leaves.size = kMaxLeaves + 1; });
  refused(Status::kBadLeafLink, [&](Case& of) { of.object.leaves = {&leaf, 1}; });
  Leaf lost = leaf;
  lost.link = 2;
  refused(Status::kBadLeafLink, [&](Case& of) { of.robot.leaves = {&lost, 1}; });
  refused(Status::kBadIgnoredPair, [](Case& of) { of.robot.ignored_pairs.data = nullptr; });
  refused(Status::kBadIgnoredPair, [&](Case& of) { of.robot.ignored_pairs = {&no_pair, 1}; });
  refused(Status::kBadIgnoredPair, [](Case& of) { of.robot.ignored_hops = 2; });
  refused(Status::kBadIgnoredPair, [&](Case& of) { of.object.touch_links = no_link; });
  refused(Status::kBadIgnoredPair, [](Case& of) { of.object.touch_links.data = nullptr; });
  refused(Status::kBadRestPose, [&](Case& of) { of.robot.rest_pose.data = pose; });
  for (const double wrong : {nan, infinite, -infinite}) {
    refused(Status::kBadPoses, [&](Case& of) { of.object.rotation[2] = wrong; });
    refused(Status::kBadPoses, [&](Case& of) { of.object.translation[1] = wrong; });
  }
  refused(Status::kBadPoses, [](Case& of) { of.object.rotation[3] = 0; });

  // Whether leaves are right is for the engine, which counts the object's after the robot's.
  for (const double length : {1e-200, 1., 1e200}) {
    right.object.rotation[3] = length;
    REQUIRE(attached.set(right.robot, right.kinematics, right.object) == Status::kOk);
    CHECK(attached.kinematics().links[2].rotation[3] == 1);
    CHECK(CollisionChecker().set_robot(attached.desc(), attached.kinematics()) == Status::kOk);
  }
  Leaf bad = ball;
  bad.box.half[0] = -1;
  right.object.leaves = {&bad, 1};
  REQUIRE(attached.set(right.robot, right.kinematics, right.object) == Status::kOk);
  std::uint32_t bad_leaf = 7;
  CHECK(CollisionChecker().set_robot(attached.desc(), attached.kinematics(), &bad_leaf) == Status::kBadLeafBox);
  CHECK(bad_leaf == 1);
  // A robot without shapes may hold something.
  right.object.leaves = {&ball, 1};
  right.robot.leaves = {};
  REQUIRE(attached.set(right.robot, right.kinematics, right.object) == Status::kOk);
  CHECK(CollisionChecker().set_robot(attached.desc(), attached.kinematics()) == Status::kOk);
}

}  // namespace cab::tests
