// CollisionChecker::check_motions: against states all along the motions, and motions whose moment is known; and the
// bound that it proves them with.
#include <cab/collision_checker.h>

#include "perf/harness/random_joints.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace cab::tests {
namespace {

using namespace cab::oracle;

constexpr std::int32_t kOneLink[] = {-1};
constexpr std::int32_t kTwoLinks[] = {-1, 0};

// With short levers and thin boxes, so that some motions are free.
JointedRig random_robot(Random& random) {
  JointedRig out = random_jointed_rig(random, 7, 1, 0.5);
  for (JointDesc& joint : out.body.joints)
    for (double& x : joint.anchor) x *= 0.2;
  for (Leaf& leaf : out.rig.leaves)
    for (float& half : leaf.box.half) half *= 0.4f;
  return out;
}

std::vector<double> blend(const std::vector<double>& from, const std::vector<double>& to, double t) {
  std::vector<double> out(from.size());
  for (std::size_t v = 0; v < from.size(); ++v) out[v] = from[v] + t * (to[v] - from[v]);
  return out;
}

// How many of a checker's states collide, of motions at equally many moments.
std::vector<StateAnswer> answers_along(CollisionChecker& checker, const std::vector<double>& from,
                                       const std::vector<double>& to, std::size_t moments) {
  std::vector<double> states;
  for (std::size_t m = 0; m < moments; ++m) {
    const std::vector<double> state = blend(from, to, static_cast<double>(m) / static_cast<double>(moments - 1));
    states.insert(states.end(), state.begin(), state.end());
  }
  std::vector<StateAnswer> out(moments);
  REQUIRE(checker.check(states, out) == Status::kOk);
  return out;
}

bool collides_at(CollisionChecker& checker, const std::vector<double>& from, const std::vector<double>& to, double t) {
  StateAnswer answer;
  REQUIRE(checker.check(blend(from, to, t), {&answer, 1}) == Status::kOk);
  return answer == StateAnswer::kColliding;
}

// A cube of side 1 that a slide moves along x in front of another one, and its motion from 0 to `to`.
struct Slide {
  JointedBody body;
  Leaf leaf = {0, axis_aligned_box({0, 0, 0}, {.5f, .5f, .5f}), {}};
  Slide() {
    body.parents = {-1};
    body.links.resize(1);
    body.links[0].joint_count = 1;
    body.joints.resize(1);
    body.joints[0].kind = JointKind::kPrismatic;
    body.joints[0].axis[0] = 1;
    body.joints[0].axis[2] = 0;
    body.variable_count = 1;
  }
  ArticulationDesc desc() const { return {kOneLink, {}, {&leaf, 1}, {}}; }
};

}  // namespace

TEST_CASE("a motion that is called free has no state that collides, and others touch where they are said to") {
  std::size_t counts[4] = {}, touching = 0;
  for (std::uint64_t seed = 1; seed <= rounds(150); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    const JointedRig robot = random_robot(random);
    const std::uint32_t variables = robot.body.variable_count;
    CollisionChecker checker;
    REQUIRE(checker.set_robot(robot.rig.desc(), robot.body.desc()) == Status::kOk);
    const float wall[] = {0, 0, 0, 1, 0, 0, random.chance(0.5) ? 1.0f : 50.0f};
    const Leaf slab = {0, axis_aligned_box({0, 0, 0}, {2, 2, .1f}), {}};
    if (random.chance(0.5)) REQUIRE(checker.add_fixed({kOneLink, {}, {&slab, 1}, {}}, wall) == Status::kOk);
    checker.world().job().margin = random.chance(0.3) ? 0.02f : 0;
    constexpr std::size_t kMotions = 70;
    std::vector<double> from(kMotions * variables), to(kMotions * variables);
    for (double& x : from) x = random.uniform(-3, 3);
    for (std::size_t i = 0; i < to.size(); ++i) to[i] = from[i] + random.uniform(-1, 1) * (i % 7 == 0 ? 1 : 0.1);
    std::vector<MotionAnswer> any(kMotions), first(kMotions);
    std::vector<double> moments(kMotions, -1);
    MotionSearch search, search_first;
    search_first.first_moments = moments;
    REQUIRE(checker.check_motions(from, to, any, search) == Status::kOk);
    REQUIRE(checker.check_motions(from, to, first, search_first) == Status::kOk);
    CHECK(search.state_count <= search_first.state_count);
    for (std::size_t m = 0; m < kMotions; m += 9) {
      MotionAnswer alone;
      double moment = -1;
      MotionSearch one;
      one.first_moments = {&moment, 1};
      const Span<const double> a = {from.data() + m * variables, variables}, b = {to.data() + m * variables, variables};
      REQUIRE(checker.check_motions(a, b, {&alone, 1}, one) == Status::kOk);
      CHECK(alone == first[m]);
      CHECK(moment == moments[m]);
    }
    for (std::size_t m = 0; m < kMotions; ++m) {
      CAPTURE(m);
      const std::vector<double> a(from.begin() + static_cast<std::ptrdiff_t>(m * variables),
                                  from.begin() + static_cast<std::ptrdiff_t>((m + 1) * variables));
      const std::vector<double> b(to.begin() + static_cast<std::ptrdiff_t>(m * variables),
                                  to.begin() + static_cast<std::ptrdiff_t>((m + 1) * variables));
      constexpr std::size_t kMoments = 257;
      const std::vector<StateAnswer> along = answers_along(checker, a, b, kMoments);
      const auto sampled = std::find(along.begin(), along.end(), StateAnswer::kColliding);
      ++counts[static_cast<std::size_t>(first[m])];
      CHECK(any[m] != MotionAnswer::kNotTested);
      if (any[m] == MotionAnswer::kFree || first[m] == MotionAnswer::kFree) {
        CHECK(any[m] == first[m]);
        CHECK(sampled == along.end());
      } else if (first[m] == MotionAnswer::kColliding) {
        CHECK(any[m] == MotionAnswer::kColliding);
        touching += collides_at(checker, a, b, moments[m]);
      } else {
        CHECK(any[m] == first[m]);
      }
      if (first[m] == MotionAnswer::kFree) continue;
      CHECK((moments[m] >= 0 && moments[m] <= 1));
      CHECK(static_cast<double>(sampled - along.begin()) / (kMoments - 1) >= moments[m]);
    }
  }
  CHECK(counts[0] >= least_count(2000, 150));
  CHECK(counts[1] >= least_count(200, 150));
  CHECK(touching > counts[1] / 2);
}

TEST_CASE("the first moment of a slide into a wall is known, however small the resolution") {
  Slide slide;
  CollisionChecker checker;
  REQUIRE(checker.set_robot(slide.desc(), slide.body.desc()) == Status::kOk);
  const float wall[] = {0, 0, 0, 1, 3, 0, 0};
  REQUIRE(checker.add_fixed(slide.desc(), wall) == Status::kOk);
  const std::vector<double> from = {0, 0, 0, 5, 1.5}, to = {10, 1.999999, 2, 10, 2.5};
  for (const double resolution : {0.1, 1e-3, 1e-5}) {
    CAPTURE(resolution);
    std::vector<MotionAnswer> answers(5);
    std::vector<double> moments(5, -1);
    MotionSearch search;
    search.resolution = resolution;
    search.first_moments = moments;
    REQUIRE(checker.check_motions(from, to, answers, search) == Status::kOk);
    CHECK(answers[0] == MotionAnswer::kColliding);  // at x = 2
    CHECK(moments[0] == doctest::Approx(0.2).epsilon(resolution));
    CHECK(moments[0] <= 0.2 + 1e-6);
    CHECK(answers[1] == MotionAnswer::kTooClose);  // its end is 1e-6 away
    CHECK(moments[1] == doctest::Approx(1).epsilon(resolution));
    CHECK(answers[2] == MotionAnswer::kColliding);  // it ends where the faces meet
    CHECK(moments[2] == doctest::Approx(1).epsilon(resolution));
    CHECK(answers[3] == MotionAnswer::kFree);
    CHECK(moments[3] == -1);
    CHECK(answers[4] == MotionAnswer::kColliding);
    CHECK(moments[4] == doctest::Approx(0.5).epsilon(resolution));
  }
}

TEST_CASE("motions whose numbers are not finite are not tested, and the others are") {
  Slide slide;
  CollisionChecker checker;
  REQUIRE(checker.set_robot(slide.desc(), slide.body.desc()) == Status::kOk);
  const double inf = std::numeric_limits<double>::infinity(), nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<double> from = {0, nan, 0, 0, -1e300}, to = {1, 1, inf, 2e18, 1e300};
  std::vector<MotionAnswer> answers(5);
  MotionSearch search;
  REQUIRE(checker.check_motions(from, to, answers, search) == Status::kOk);
  CHECK(answers[0] == MotionAnswer::kFree);
  for (std::size_t m = 1; m < 5; ++m) CHECK(answers[m] == MotionAnswer::kNotTested);

  Slide turn;
  turn.body.joints[0].kind = JointKind::kRevolute;
  turn.body.links[0].translation[0] = 2;
  CollisionChecker turning;
  REQUIRE(turning.set_robot(turn.desc(), turn.body.desc()) == Status::kOk);
  const float wall[] = {0, 0, 0, 1, 0, 2, 0};
  REQUIRE(turning.add_fixed(turn.desc(), wall) == Status::kOk);
  const std::vector<double> zeros(4, 0), far = {1e300, 1e308, 1.5e308, 1.7e308};
  answers.resize(4);
  REQUIRE(turning.check_motions(zeros, far, answers, search) == Status::kOk);
  for (const MotionAnswer of_far : answers) CHECK(of_far == MotionAnswer::kNotTested);
}

TEST_CASE("a slide along a face ends, and a state keeps its answer as the end of a motion") {
  Slide slide;
  CollisionChecker checker;
  REQUIRE(checker.set_robot(slide.desc(), slide.body.desc()) == Status::kOk);
  const float wall[] = {0, 0, 0, 1, 0.3f, 1.0000005f, 0};
  REQUIRE(checker.add_fixed(slide.desc(), wall) == Status::kOk);
  const std::vector<double> from = {0}, to = {0.6};
  MotionAnswer answer;
  MotionSearch search;
  for (const double resolution : {1e-3, 1e-9, 1e-300}) {
    search.resolution = resolution;
    REQUIRE(checker.check_motions(from, to, {&answer, 1}, search) == Status::kOk);
    CHECK(answer == MotionAnswer::kTooClose);
    CHECK(search.state_count < 3000000);
  }
  CollisionChecker with_margin;
  REQUIRE(with_margin.set_robot(slide.desc(), slide.body.desc()) == Status::kOk);
  REQUIRE(with_margin.add_fixed(slide.desc(), wall) == Status::kOk);
  with_margin.world().job().margin = 1;
  for (const double x : {2.3 - 5e-7, 2.3 + 5e-7}) {
    StateAnswer state;
    REQUIRE(with_margin.check({&x, 1}, {&state, 1}) == Status::kOk);
    search.resolution = 1e-3;
    const double away = 4;
    double moment = -1;
    search.first_moments = {&moment, 1};
    REQUIRE(with_margin.check_motions({&x, 1}, {&away, 1}, {&answer, 1}, search) == Status::kOk);
    CHECK((answer == MotionAnswer::kColliding) == (state == StateAnswer::kColliding));
  }
}

TEST_CASE("no motion of large numbers is free whose state collides") {
  Slide slide;
  slide.body.joints[0].offset = -1e12;
  CollisionChecker checker;
  REQUIRE(checker.set_robot(slide.desc(), slide.body.desc()) == Status::kOk);
  const float wall[] = {0, 0, 0, 1, 1, 0, 0};
  REQUIRE(checker.add_fixed(slide.desc(), wall) == Status::kOk);
  MotionSearch search;
  search.resolution = 1e-5;
  Random random(3);
  for (std::uint64_t i = 0; i < rounds(300); ++i) {
    const double from = 1e12 - random.uniform(1, 3), to = 1e12 + random.uniform(-1.2, -0.8) + 1e-4 * random.index(9);
    MotionAnswer answer;
    REQUIRE(checker.check_motions({&from, 1}, {&to, 1}, {&answer, 1}, search) == Status::kOk);
    StateAnswer end;
    REQUIRE(checker.check({&to, 1}, {&end, 1}) == Status::kOk);
    if (end == StateAnswer::kColliding) CHECK(answer == MotionAnswer::kColliding);
  }
}

TEST_CASE("check_motions refuses what does not fit, and robots without bounds") {
  Slide slide;
  CollisionChecker checker;
  const std::vector<double> state = {0};
  MotionAnswer answer = MotionAnswer::kNotTested;
  MotionSearch search;
  CHECK(checker.check_motions(state, state, {&answer, 1}, search) == Status::kUnknownBatch);
  REQUIRE(checker.set_robot(slide.desc(), slide.body.desc()) == Status::kOk);
  CHECK(checker.check_motions({}, state, {&answer, 1}, search) == Status::kBadOutput);
  CHECK(checker.check_motions(state, {}, {&answer, 1}, search) == Status::kBadOutput);
  CHECK(checker.check_motions(state, state, {nullptr, 1}, search) == Status::kBadOutput);
  for (const double bad : {0.0, -1.0, 1.1e18, HUGE_VAL, std::nan("")}) {
    search.resolution = bad;
    CHECK(checker.check_motions(state, state, {&answer, 1}, search) == Status::kBadResolution);
  }
  search.resolution = 1;
  std::vector<double> moments(2);
  search.first_moments = moments;
  CHECK(checker.check_motions(state, state, {&answer, 1}, search) == Status::kBadOutput);
  search.first_moments = {};
  CHECK(checker.check_motions({}, {}, {}, search) == Status::kOk);
  CHECK(checker.check_motions(state, state, {&answer, 1}, search) == Status::kOk);
  CHECK(answer == MotionAnswer::kFree);

  ConvexPart plane;
  plane.kind = ShapeKind::kHalfSpace;
  Slide endless;
  endless.leaf.parts = {&plane, 1};
  CollisionChecker of_plane;
  REQUIRE(of_plane.set_robot(endless.desc(), endless.body.desc()) == Status::kOk);
  CHECK(of_plane.check_motions(state, state, {&answer, 1}, search) == Status::kBadShape);
}

TEST_CASE("no point of a link moves farther against another link than the bound says") {
  double closest = 0;
  for (std::uint64_t seed = 1; seed <= rounds(300); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    JointedBody body = random_joints(random, 6);
    const std::size_t links = body.parents.size();
    // One leaf per link: a box of no size at a point.
    std::vector<Leaf> leaves;
    for (std::uint32_t l = 0; l < links; ++l) {
      float point[3];
      const auto at = random.uniform(0, 1) * random.unit_vector();
      for (std::size_t c = 0; c < 3; ++c) point[c] = static_cast<float>(at[c]);
      leaves.push_back({l, axis_aligned_box(point, {0, 0, 0}), {}});
    }
    const bool fixed = random.chance(0.5);
    detail::MotionBound bound;
    REQUIRE(bound.set({body.parents, {}, leaves, {}}, body.desc(), {}) == Status::kOk);
    std::vector<double> from(body.variable_count), to(body.variable_count);
    for (double& x : from) x = random.uniform(-2, 2);
    const double size = random.log_uniform(1e-2, 2);
    for (std::size_t v = 0; v < to.size(); ++v) to[v] = from[v] + random.uniform(-size, size);
    const double length = bound.length(from.data(), to.data(), fixed);
    std::vector<std::vector<double>> distances;
    for (const double t : {0.0, 0.3, 0.5, 1.0}) {
      std::vector<float> poses(7 * links);
      REQUIRE(compute_link_poses(body.desc(), blend(from, to, t), Isa::kAuto, poses) == Status::kOk);
      std::vector<Vec3<double>> points;
      for (std::size_t l = 0; l < links; ++l) {
        const float* const pose = poses.data() + 7 * l;
        double column[3][3];
        const double q[4] = {static_cast<double>(pose[0]), static_cast<double>(pose[1]), static_cast<double>(pose[2]),
                             static_cast<double>(pose[3])};
        quaternion_matrix(q, column);
        Vec3<double> at = {static_cast<double>(pose[4]), static_cast<double>(pose[5]), static_cast<double>(pose[6])};
        for (std::size_t k = 0; k < 3; ++k)
          for (std::size_t c = 0; c < 3; ++c) at[c] += static_cast<double>(leaves[l].box.center[k]) * column[k][c];
        points.push_back(at);
      }
      std::vector<double>& row = distances.emplace_back();
      for (std::size_t a = 0; a < links; ++a) {
        for (std::size_t b = a + 1; b < links; ++b) {
          const Vec3<double> between = points[b] - points[a];
          row.push_back(std::sqrt(dot(between, between)));
        }
        if (!fixed) continue;
        const Vec3<double> between = points[a] - Vec3<double>{3, 0, 0};
        row.push_back(std::sqrt(dot(between, between)));
      }
    }
    const double slack = bound.rounding();
    for (std::size_t i = 0; i < distances[0].size(); ++i) {
      const double moved = std::fabs(distances[3][i] - distances[0][i]);
      CHECK(moved <= length + slack);
      CHECK(std::fabs(distances[2][i] - distances[0][i]) <= length / 2 + slack);
      CHECK(std::fabs(distances[1][i] - distances[0][i]) <= 0.3 * length + slack);
      if (length > 0) closest = std::max(closest, moved / length);
    }
  }
  CHECK(closest > 0.5);
}

TEST_CASE("a pair that is not tested, and joints above both links, do not count") {
  JointedBody body;
  body.parents = {-1, 0};
  body.links.resize(2);
  body.links[0].joint_count = body.links[1].joint_count = 1;
  body.links[1].translation[0] = 2;
  body.joints.resize(2);
  body.joints[1].variable = 1;
  body.variable_count = 2;
  std::vector<Leaf> leaves = {{0, axis_aligned_box({0, 0, 0}, {0, 0, 0}), {}},
                              {1, axis_aligned_box({1, 0, 0}, {0, 0, 0}), {}}};
  const ArticulationDesc desc = {kTwoLinks, {}, leaves, {}};
  detail::MotionBound bound;
  const double zero[] = {0, 0}, first[] = {1, 0}, second[] = {0, 0.5};
  REQUIRE(bound.set(desc, body.desc(), {}) == Status::kOk);
  CHECK(bound.length(zero, first, false) == 0);
  CHECK(bound.length(zero, second, false) == doctest::Approx(0.5).epsilon(1e-3));
  CHECK(bound.length(zero, first, true) == doctest::Approx(3).epsilon(1e-3));
  // What overflows is no length: a sum of infinities of both signs.
  JointedBody away = body;
  away.links[0].translation[0] = 2;
  detail::MotionBound far_bound;
  const double far[] = {1.7e308, 0};
  REQUIRE(far_bound.set(desc, away.desc(), {}) == Status::kOk);
  CHECK_FALSE(std::isfinite(far_bound.length(zero, far, true)));
  // Two links that turn on a common one: what both move counts.
  JointedBody fork = body;
  fork.parents = {-1, 0, 0};
  fork.links.push_back(fork.links[1]);
  fork.joints.push_back(fork.joints[1]);
  fork.joints[2].variable = 2;
  fork.variable_count = 3;
  leaves[0].link = 2;
  leaves[0].box.center[0] = 1;
  const double none[] = {0, 0, 0}, one_turn[] = {0, 0.5, 0}, both_turn[] = {0, 0.5, 0.25};
  detail::MotionBound forked;
  REQUIRE(forked.set({fork.parents, {}, leaves, {}}, fork.desc(), {}) == Status::kOk);
  CHECK(forked.length(none, one_turn, false) == doctest::Approx(0.5).epsilon(1e-3));
  CHECK(forked.length(none, both_turn, false) == doctest::Approx(0.75).epsilon(1e-3));
  leaves[0].link = 0;
  const IgnoredPair ignored = {0, 1, {}};
  REQUIRE(bound.set(desc, body.desc(), {&ignored, 1}) == Status::kOk);
  CHECK(bound.length(zero, second, false) == 0);
}

}  // namespace cab::tests
