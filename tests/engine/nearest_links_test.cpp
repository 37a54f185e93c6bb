// The nearest links of states: the distances of plain frames, and gradients that differences of states confirm.
#include <cab/collision_checker.h>

#include "perf/harness/random_joints.h"
#include "perf/harness/random_rig.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace cab::tests {
namespace {

using namespace cab::oracle;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr float kPose[7] = {0, 0, 0, 1, 0, 0, 2.5f};

std::vector<double> random_states(Random& random, const JointedRig& robot, std::size_t count) {
  std::vector<double> states(count * robot.body.variable_count);
  for (double& x : states) x = random.uniform(-3, 3);
  return states;
}

// A checker of a robot, with a body of one link at kPose.
struct Scene {
  JointedRig robot;
  Rig fixed;
  CollisionChecker checker;

  explicit Scene(Random& random)
      : robot(random_jointed_rig(random, 8, 2, 0.6)), fixed(random_rig(random, Topology::kStar, 1, 2)) {
    REQUIRE(checker.set_robot(robot.rig.desc(), robot.body.desc()) == Status::kOk);
    std::vector<float> poses;
    for (std::uint32_t l = 0; l < fixed.link_count(); ++l) poses.insert(poses.end(), kPose, kPose + 7);
    fixed_poses = poses;
    REQUIRE(checker.add_fixed(fixed.desc(), fixed_poses) == Status::kOk);
  }
  std::vector<float> fixed_poses;
};

// A point that is fixed to a link, moved with it from one set of poses to another.
Vec3<double> carried(const float* from, const float* to, const float (&point)[3]) {
  const auto matrix = [](const float* pose, double(&column)[3][3]) {
    const double q[4] = {pose[0], pose[1], pose[2], pose[3]};
    quaternion_matrix(q, column);
  };
  double before[3][3], after[3][3];
  matrix(from, before);
  matrix(to, after);
  Vec3<double> out{{to[4], to[5], to[6]}};
  for (int k = 0; k < 3; ++k) {
    double along = 0;
    for (std::size_t c = 0; c < 3; ++c) along += before[k][c] * (double{point[c]} - double{from[4 + c]});
    for (std::size_t c = 0; c < 3; ++c) out[c] += along * after[k][c];
  }
  return out;
}

}  // namespace

TEST_CASE("the nearest links of a state are those of a frame with the whole margin, touching ones among them") {
  std::uint64_t touching = 0, near = 0, with_fixed = 0, none = 0;
  for (std::uint64_t seed = 1; seed <= rounds(60); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    Scene scene(random);
    const std::size_t count = random.chance(0.1) ? 1500 : 1 + random.index(60),
                      variables = scene.robot.body.variable_count;
    std::vector<double> states = random_states(random, scene.robot, count);
    const float most = random.chance(0.2) ? 0.0f : static_cast<float>(random.log_uniform(0.01, 3));
    std::vector<NearestLinks> nearest(count);
    scene.checker.world().job().margin = 0.25f;
    REQUIRE(scene.checker.find_nearest(states, nearest, most) == Status::kOk);
    CHECK(scene.checker.world().job().margin == 0.25f);

    // The same by one frame, from all pairs within the margin.
    scene.checker.world().job().margin = most;
    scene.checker.world().want_contacts();
    const std::uint32_t tested = std::min(scene.checker.chunk(), static_cast<std::uint32_t>(count));
    REQUIRE(scene.checker.find_hits({states.data(), tested * variables}, tested) == Status::kOk);
    std::vector<float> least(tested, std::numeric_limits<float>::infinity());
    const Span<const Hit> hits = scene.checker.world().hits();
    for (std::size_t h = 0; h < hits.size; ++h) {
      float& of = least[hits[h].instance_a];
      of = std::min(of, -scene.checker.world().contacts()[h].depth);
    }
    for (std::uint32_t i = 0; i < tested; ++i) {
      CHECK(nearest[i].distance == least[i]);
      touching += nearest[i].distance <= 0;
      none += nearest[i].distance > most;
      with_fixed += nearest[i].fixed == 0;
      if (!(nearest[i].distance <= most)) continue;
      ++near;
      bool is_listed = false;
      for (std::size_t h = 0; h < hits.size; ++h)
        is_listed =
            is_listed || (hits[h].instance_a == i && hits[h].link_a == nearest[i].link_a &&
                          hits[h].link_b == nearest[i].link_b && scene.checker.fixed_of(hits[h]) == nearest[i].fixed &&
                          -scene.checker.world().contacts()[h].depth == nearest[i].distance);
      CHECK(is_listed);
    }
    const std::size_t bad = random.index(static_cast<unsigned>(count));
    for (std::size_t v = 0; v < variables; ++v) states[bad * variables + v] = kNan;
    std::vector<NearestLinks> again(count);
    REQUIRE(scene.checker.find_nearest(states, again, most) == Status::kOk);
    for (std::size_t i = 0; i < count; ++i)
      if (i != bad) CHECK(again[i].distance == nearest[i].distance);
    if (!scene.robot.body.joints.empty()) CHECK(std::isnan(again[bad].distance));
  }
  CHECK(touching >= least_count(100, 60));
  CHECK(near >= least_count(200, 60));
  CHECK(with_fixed >= least_count(20, 60));
  CHECK(none >= least_count(20, 60));
}

TEST_CASE("a gradient is how the distance of the nearest points changes with each variable, for joints of all kinds") {
  std::uint64_t compared = 0, moving = 0;
  for (std::uint64_t seed = 1; seed <= rounds(120); ++seed) {
    CAPTURE(seed);
    Random random(1000 + seed);
    Scene scene(random);
    const KinematicsDesc kinematics = scene.robot.body.desc();
    const std::size_t variables = kinematics.variable_count, links = kinematics.link_parents.size;
    std::vector<double> state = random_states(random, scene.robot, 1);
    if (random.chance(0.2)) std::fill(state.begin(), state.end(), 0.0);  // a ball joint at rest has no axis
    NearestLinks nearest;
    std::vector<double> gradient(variables, 7);
    REQUIRE(scene.checker.find_nearest(state, {&nearest, 1}, 10, gradient) == Status::kOk);
    if (!(nearest.distance <= 10)) {
      for (const double g : gradient) CHECK(g == 0);
      continue;
    }
    const auto poses_of = [&](const std::vector<double>& of) {
      std::vector<float> poses(7 * links);
      REQUIRE(compute_link_poses(kinematics, of, Isa::kScalar, poses) == Status::kOk);
      return poses;
    };
    const std::vector<float> here = poses_of(state);
    for (std::size_t v = 0; v < variables; ++v) {
      CAPTURE(v);
      constexpr double kStep = 1e-3;
      const auto distance_at = [&](double step) {
        std::vector<double> moved = state;
        moved[v] += step;
        const std::vector<float> there = poses_of(moved);
        const auto at = [&](std::uint32_t link, const float(&point)[3]) {
          return carried(here.data() + 7 * link, there.data() + 7 * link, point);
        };
        const Vec3<double> a = at(nearest.link_a, nearest.point_a),
                           b = nearest.fixed < 0
                                   ? at(nearest.link_b, nearest.point_b)
                                   : Vec3<double>{{nearest.point_b[0], nearest.point_b[1], nearest.point_b[2]}};
        return dot(b - a, Vec3<double>{{nearest.normal[0], nearest.normal[1], nearest.normal[2]}});
      };
      const double slope = (distance_at(kStep) - distance_at(-kStep)) / (2 * kStep);
      // Poses are floats: 2^-24 of some units, over the step.
      CHECK(std::fabs(gradient[v] - slope) < 2e-3 * (1 + std::fabs(slope)));
      ++compared;
      moving += std::fabs(slope) > 0.05;
    }
  }
  CHECK(compared >= least_count(500, 120));
  CHECK(moving >= least_count(100, 120));
}

TEST_CASE("a gradient is the slope of the distance itself where the nearest points stay the same") {
  // A ball on an arm, above a plane of the fixed body.
  Random random(5);
  JointedBody body;
  body.parents = {-1};
  body.links.resize(1);
  body.links[0].joint_count = 1;
  body.joints.resize(1);
  for (int c = 0; c < 3; ++c) body.joints[0].axis[c] = c == 1;
  body.variable_count = 1;
  const ConvexPart ball = {ShapeKind::kSphere, {1, 0, 0}, {0, 0, 0, 1}, {0.25f, 0, 0}, {}};
  const Leaf leaf = {0, {{1, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0.25f, 0.25f, 0.25f}}, {&ball, 1}};
  const std::int32_t root = -1;
  ArticulationDesc desc;
  desc.link_parents = {&root, 1};
  desc.leaves = {&leaf, 1};
  const Leaf table_leaf = {0, {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {4, 4, 0.5f}}, {}};
  ArticulationDesc table = desc;
  table.leaves = {&table_leaf, 1};
  CollisionChecker checker;
  REQUIRE(checker.set_robot(desc, body.desc()) == Status::kOk);
  const float below[7] = {0, 0, 0, 1, 0, 0, -2};
  REQUIRE(checker.add_fixed(table, below) == Status::kOk);
  for (const double angle : {-1.0, -0.3, 0.0, 0.7, 1.5}) {
    NearestLinks nearest;
    double gradient = 0;
    REQUIRE(checker.find_nearest({&angle, 1}, {&nearest, 1}, 5, {&gradient, 1}) == Status::kOk);
    CHECK(nearest.distance == doctest::Approx(1.5 - 0.25 - std::sin(angle)).epsilon(1e-6));
    CHECK(gradient == doctest::Approx(-std::cos(angle)).epsilon(1e-5));
    CHECK(nearest.fixed == 0);
    CHECK(nearest.normal[2] == doctest::Approx(-1));
  }
}

TEST_CASE("find_nearest refuses what it cannot take") {
  Random random(3);
  Scene scene(random);
  CollisionChecker empty;
  NearestLinks nearest;
  CHECK(empty.find_nearest({}, {}, 1) == Status::kUnknownBatch);
  const std::size_t variables = scene.robot.body.variable_count;
  const std::vector<double> state(variables, 0.5);
  std::vector<double> gradient(variables + 1);
  CHECK(scene.checker.find_nearest({state.data(), variables - 1}, {&nearest, 1}, 1) == Status::kBadOutput);
  CHECK(scene.checker.find_nearest(state, {&nearest, 1}, 1, gradient) == Status::kBadOutput);
  CHECK(scene.checker.find_nearest(state, {nullptr, 1}, 1) == Status::kBadOutput);
  for (const float most :
       {-1.0f, 2e18f, std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN()})
    CHECK(scene.checker.find_nearest(state, {&nearest, 1}, most) == Status::kBadMargin);
  for (const float most : {0.0f, 1e-45f, 4e-44f, 1e-38f, 1e18f})
    CHECK(scene.checker.find_nearest(state, {&nearest, 1}, most) == Status::kOk);
  CHECK(scene.checker.find_nearest({}, {}, 1) == Status::kOk);
  CHECK(scene.checker.find_nearest(state, {&nearest, 1}, 1) == Status::kOk);
  CHECK(scene.checker.flags().empty());
}

}  // namespace cab::tests
