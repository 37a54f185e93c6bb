// The judge of motions: it finds known moments, and between its steps it overlooks nothing.
#include "perf/judge/oracle/motion_judge.h"

#include <doctest/doctest.h>

#include <cmath>

#include "tests/rounds.h"

namespace {

using namespace cab;
using namespace cab::oracle;
using cab::tests::least_count;
using cab::tests::rounds;

Leaf leaf_at(float x, float y, float half) {
  Leaf out;
  out.box.center[0] = x, out.box.center[1] = y;
  for (float& h : out.box.half) h = half;
  return out;
}

// A cube of side 1, its centre at (x, 0, 0) of a link with one joint along or about an axis.
JointedRig one_joint(JointKind kind, std::size_t axis, float x) {
  JointedRig out;
  out.body.parents = out.rig.parents = {-1};
  out.body.links.resize(1);
  out.body.links[0].joint_count = 1;
  JointDesc& joint = out.body.joints.emplace_back();
  joint.kind = kind;
  for (std::size_t c = 0; c < 3; ++c) joint.axis[c] = c == axis ? 1 : 0;
  out.body.variable_count = kind == JointKind::kBall ? 3 : 1;
  out.rig.leaves = {leaf_at(x, 0, .5f)};
  return out;
}

TEST_CASE("a slide into a wall touches where the faces meet, and one that ends before it never does") {
  const JointedRig slide = one_joint(JointKind::kPrismatic, 0, 0);
  const std::vector<Leaf> wall = {leaf_at(3, 0, .5f)};
  const std::vector<double> zero = {0}, near = {1.999}, far = {10};
  const MotionJudge through(slide, wall, zero, far);
  const Approach touch = through.first_within(0, 0), deep = through.first_within(-0.5L, 0);
  CHECK(touch.kind == Approach::kFound);
  CHECK(std::fabs(touch.moment - 0.2L) < through.slack());
  CHECK(std::fabs(deep.moment - 0.25L) < through.slack());
  CHECK(through.first_within(0, 0.5L).kind == Approach::kNever);
  CHECK(through.first_within(0, 0.3L).moment == 0.3L);
  const MotionJudge before(slide, wall, zero, near);
  CHECK(before.first_within(0, 0).kind == Approach::kNever);
  CHECK(std::fabs(before.separation(1) - 0.001L) < 1e-15L);
  CHECK(before.first_within(0.0011L, 0).kind == Approach::kFound);
}

TEST_CASE("revolute and ball joints turn by the right hand about their anchors") {
  // The cube at x = 2 turns about z to y = 2, where a small one waits, by both kinds; about an anchor it stays away.
  const std::vector<Leaf> waiting = {leaf_at(0, 2, .125f)};
  const std::vector<double> zeros = {0, 0, 0}, quarter = {std::acos(-1.) / 2}, ball = {0, 0, std::acos(-1.) / 2};
  JointedRig turn = one_joint(JointKind::kRevolute, 2, 2);
  const JointedRig turn_by_ball = one_joint(JointKind::kBall, 2, 2);
  const MotionJudge one(turn, waiting, zeros, quarter), other(turn_by_ball, waiting, zeros, ball);
  const Approach touch = one.first_within(0, 0);
  CHECK(touch.kind == Approach::kFound);
  CHECK(std::fabs(touch.moment - other.first_within(0, 0).moment) < one.slack());
  CHECK(std::fabs(one.separation(1) + 0.625L) < 1e-15L);
  turn.body.joints[0].anchor[0] = 2;
  const MotionJudge about_itself(turn, waiting, zeros, quarter);
  CHECK(about_itself.first_within(0, 0).kind == Approach::kNever);
  CHECK(std::fabs(about_itself.separation(1) - about_itself.separation(0)) < 1e-7L);
}

TEST_CASE("at no moment before the first are boxes nearer, and at that moment they are as near") {
  std::size_t found = 0, never = 0;
  for (std::uint64_t seed = 1; seed <= rounds(60); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    const JointedRig robot = random_jointed_rig(random, 6, 2, 0.5);
    const std::vector<Leaf> fixed(random.index(2), leaf_at(1, 0, .25f));
    std::vector<double> from(robot.body.variable_count), to(from);
    for (double& x : from) x = random.uniform(-3, 3);
    for (std::size_t v = 0; v < to.size(); ++v) to[v] = from[v] + random.uniform(-2, 2);
    const MotionJudge judge(robot, fixed, from, to);
    for (const Real level : {-0.05L, 0.0L, 0.05L}) {
      const Approach first = judge.first_within(level, 0);
      CHECK(first.kind != Approach::kUnknown);
      if (first.kind == Approach::kFound) CHECK(judge.separation(first.moment) <= level);
      for (Real moment = 0; moment < first.moment; moment += 0.01L)
        CHECK(judge.separation(moment) > level - judge.slack());
      ++(first.kind == Approach::kFound ? found : never);
    }
  }
  CHECK(found >= least_count(30, 60));
  CHECK(never >= least_count(30, 60));
}

}  // namespace
