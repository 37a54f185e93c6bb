// compute_link_poses: the same bits on every instruction set and in any division of states, and a status per fault.
// Joint states bound to a sequence: what frames of their poses find.
#include "perf/harness/random_joints.h"
#include "perf/harness/round_rig.h"
#include "perf/harness/world.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <string>
#include <vector>

namespace cab::tests {
namespace {

using namespace cab::oracle;

struct Fault {
  const char* what;
  std::function<void(JointedBody&)> plant;
  Status status;
};

const double kNan = std::numeric_limits<double>::quiet_NaN();

const Fault kFaults[] = {
    {"no links", [](JointedBody& b) { b.parents.clear(); }, Status::kNoLinks},
    {"too many links", [](JointedBody& b) { b.parents.assign(kMaxLinks + 1, -1); }, Status::kTooManyLinks},
    {"its own parent", [](JointedBody& b) { b.parents[1] = 1; }, Status::kBadParent},
    {"parent -2", [](JointedBody& b) { b.parents[0] = -2; }, Status::kBadParent},
    {"a link too few", [](JointedBody& b) { b.links.pop_back(); }, Status::kBadJoint},
    {"a joint too many", [](JointedBody& b) { b.joints.emplace_back(); }, Status::kBadJoint},
    {"a joint too few", [](JointedBody& b) { b.links[0].joint_count = 7; }, Status::kBadJoint},
    {"kind", [](JointedBody& b) { b.joints[0].kind = static_cast<JointKind>(3); }, Status::kBadJoint},
    {"variable", [](JointedBody& b) { b.joints[0].variable = 4; }, Status::kBadJoint},
    {"a ball's last variable",
     [](JointedBody& b) {
       b.joints[0].kind = JointKind::kBall;
       b.joints[0].variable = 2;
     },
     Status::kBadJoint},
    {"axis", [](JointedBody& b) { b.joints[1].axis[2] = kNan; }, Status::kBadJoint},
    {"anchor", [](JointedBody& b) { b.joints[0].anchor[0] = -HUGE_VAL; }, Status::kBadJoint},
    {"multiplier", [](JointedBody& b) { b.joints[0].multiplier = HUGE_VAL; }, Status::kBadJoint},
    {"offset", [](JointedBody& b) { b.joints[0].offset = kNan; }, Status::kBadJoint},
    {"axis of another length", [](JointedBody& b) { b.joints[0].axis[2] = 1.00001; }, Status::kBadJoint},
    {"rotation of another length", [](JointedBody& b) { b.links[1].rotation[3] = 0.99999; }, Status::kBadJoint},
    {"rotation", [](JointedBody& b) { b.links[1].rotation[3] = kNan; }, Status::kBadJoint},
    {"translation", [](JointedBody& b) { b.links[1].translation[1] = kNan; }, Status::kBadJoint},
};

// Two links with a joint each, of four variables.
JointedBody two_links() {
  JointedBody out;
  out.parents = {-1, 0};
  out.links.resize(2);
  out.links[0].joint_count = out.links[1].joint_count = 1;
  out.joints.resize(2);
  out.variable_count = 4;
  return out;
}

// Bodies with joints, and states of each: a long sequence that is tested within, and what it may be tested against, of
// as many states or of one.
struct StateWorld {
  struct Body {
    JointedBody joints;
    RoundRig round;
    Rig rig;
    bool is_round;
    std::uint32_t count;
    std::vector<double> states;
    ArticulationDesc desc() const { return is_round ? round.desc() : rig.desc(); }
  };
  std::vector<Body> bodies;
  Policies policies;
  Report report = Report::kHits;
  float margin = 0;
};

StateWorld random_state_world(Random& random) {
  StateWorld out;
  const std::uint32_t count = 1 + random.index(80), bodies = 1 + random.index(2);
  const bool is_round = random.chance(0.5);
  for (std::uint32_t b = 0; b < bodies; ++b) {
    StateWorld::Body& body = out.bodies.emplace_back();
    body.is_round = is_round;
    JointedRig made = random_jointed_rig(random, 10, 2, 0.4);
    body.joints = made.body;
    body.rig = made.rig;
    body.round = random_round_rig(random, static_cast<unsigned>(made.body.parents.size()), 3);
    body.round.parents = made.body.parents;
    body.count = b == 1 && random.chance(0.5) ? 1 : count;
    body.states.resize(std::size_t{body.count} * body.joints.variable_count);
    for (double& x : body.states) {
      x = random.uniform(-3, 3);
      if (random.chance(0.002)) x = kNan;
      if (random.chance(0.002)) x = 1e30;
    }
  }
  out.policies.exact = random.chance(0.7) ? Exact::kConvex : Exact::kNone;
  const Strategy strategies[] = {Strategy::kAuto, Strategy::kAuto, Strategy::kTree, Strategy::kBrute};
  out.policies.strategy = strategies[random.index(4)];
  if (random.chance(0.3)) out.policies.refit = static_cast<Refit>(random.index(policy_table()[0].value_count));
  if (random.chance(0.4)) out.report = Report::kInContact;
  if (random.chance(0.3)) out.margin = 0.05f;
  return out;
}

struct StateResult {
  std::vector<Hit> hits;
  std::vector<std::vector<std::uint8_t>> flags, in_contact;
  std::vector<std::vector<float>> poses;
  std::uint64_t box_tests = 0, exact_tests = 0;
};

// by_states: the frame makes the poses; else they are made before it.
StateResult run(const StateWorld& world, Isa isa, std::uint32_t threads, bool by_states) {
  EngineDesc desc;
  desc.isa = isa;
  desc.thread_count = threads;
  const EnginePtr engine = make_engine(desc);
  StateResult out;
  std::vector<BatchInput> inputs;
  std::vector<PairRule> rules;
  std::vector<KinematicsDesc> kinematics;
  for (const StateWorld::Body& body : world.bodies) kinematics.push_back(body.joints.desc());
  for (std::size_t b = 0; b < world.bodies.size(); ++b) {
    const StateWorld::Body& body = world.bodies[b];
    ArticulationId articulation;
    require(add_articulation(*engine, body.desc(), &articulation));
    const BatchId batch = add_instances(*engine, articulation, body.count, BatchKind::kSequence);
    out.flags.emplace_back(body.count, std::uint8_t{0xee});
    out.in_contact.emplace_back(body.count, std::uint8_t{0xee});
    out.poses.emplace_back(7 * body.count * body.joints.parents.size(), 7.0f);
    inputs.emplace_back();
    inputs[b].batch = batch;
    inputs[b].poses.data = out.poses[b].data();
    rules.push_back(b == 0 ? PairRule{batch, batch, Pairing::kWithin} : PairRule{inputs[0].batch, batch});
  }
  for (std::size_t b = 0; b < inputs.size(); ++b) {
    inputs[b].flags = out.flags[b];
    inputs[b].in_contact = out.in_contact[b];
    if (by_states)
      inputs[b].states = {&kinematics[b], world.bodies[b].states, out.poses[b].data()};
    else
      require(compute_link_poses(kinematics[b], world.bodies[b].states, isa, out.poses[b]));
  }
  out.hits.resize(50000);
  FrameJob job;
  job.inputs = inputs;
  job.rules = rules;
  job.policies = world.policies;
  job.report = world.report;
  job.margin = world.margin;
  job.hits = out.hits;
  require(run_frame(*engine, job));
  out.hits.resize(job.hit_count);
  out.box_tests = job.stats.box_tests;
  out.exact_tests = job.stats.exact_tests;
  return out;
}

}  // namespace

TEST_CASE("a frame of joint states finds what a frame of their poses finds, and leaves those poses") {
  std::size_t hits = 0, masked = 0, tables = 0;
  for (std::uint64_t seed = 1; seed <= rounds(300); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    const StateWorld world = random_state_world(random);
    const std::uint32_t threads = 1 + random.index(3);
    const StateResult expected = run(world, Isa::kScalar, 1, false);
    for (const Isa isa : available_isas()) {
      CAPTURE(to_string(isa));
      const StateResult found = run(world, isa, threads, true);
      CHECK(same_hits(found.hits, expected.hits));
      CHECK(found.flags == expected.flags);
      CHECK(found.in_contact == expected.in_contact);
      // A table is left out once another thread has reported it.
      if (threads == 1 || world.report == Report::kHits) {
        CHECK(found.box_tests == expected.box_tests);
        CHECK(found.exact_tests == expected.exact_tests);
      }
      for (std::size_t b = 0; b < world.bodies.size(); ++b)
        for (std::size_t i = 0; i < found.poses[b].size(); ++i)
          if (!std::isnan(expected.poses[b][i])) REQUIRE(found.poses[b][i] == expected.poses[b][i]);
    }
    for (const std::vector<std::uint8_t>& flags : expected.flags)
      for (const std::uint8_t flag : flags) masked += flag != kInstanceOk;
    hits += expected.hits.size();
    tables += world.bodies.size() == 2 && world.bodies[1].count < world.bodies[0].count;
  }
  CHECK(hits > 50);
  CHECK(masked > 2);
  CHECK(tables > 2);
}

TEST_CASE("joint states that do not fit their batch are refused, in words too") {
  Random random(1);
  JointedRig robot = random_jointed_rig(random, 5, 2, 0.4);
  const EnginePtr engine = make_engine();
  const BatchId batch = add_instances(*engine, add_rig(*engine, robot.rig), 3, BatchKind::kSequence);
  const BatchId character = add_instances(*engine, add_rig(*engine, robot.rig), 3);
  const std::vector<double> states(3 * robot.body.variable_count, 0.5);
  std::vector<float> poses(7 * 3 * robot.body.parents.size()), other = poses;
  const JointedBody longer = [&] {
    JointedBody out = robot.body;
    out.parents.push_back(0);
    out.links.emplace_back();
    return out;
  }();
  JointedBody broken = robot.body;
  broken.links[0].translation[0] = kNan;
  const KinematicsDesc right = robot.body.desc(), of_longer = longer.desc(), of_broken = broken.desc();
  const auto refusal = [&](Status status, const std::function<void(BatchInput&)>& spoil) {
    BatchInput input;
    input.batch = batch;
    input.poses.data = poses.data();
    input.states = {&right, states, poses.data()};
    spoil(input);
    const PairRule rule = {input.batch, input.batch, Pairing::kWithin};
    std::vector<Hit> hits(1000);
    FrameJob job;
    job.inputs = {&input, 1};
    job.rules = {&rule, 1};
    job.hits = hits;
    CHECK(run_frame(*engine, job) == status);
    char words[512] = {};
    explain_job(*engine, job, words);
    return std::string(words);
  };
  const auto has = [](const std::string& text, const char* part) { return text.find(part) != std::string::npos; };
  refusal(Status::kOk, [](BatchInput&) {});
  CHECK(has(refusal(Status::kBadStates, [&](BatchInput& in) { in.batch = character; }), "for characters"));
  CHECK(has(refusal(Status::kBadStates, [&](BatchInput& in) { in.states.kinematics = &of_longer; }), "links"));
  CHECK(has(refusal(Status::kBadStates, [&](BatchInput& in) { --in.states.values.size; }), "numbers"));
  CHECK(has(refusal(Status::kBadStates, [&](BatchInput& in) { in.states.values.data = nullptr; }), "numbers"));
  CHECK(has(refusal(Status::kBadStates, [&](BatchInput& in) { ++in.states.values.size; }), "numbers"));
  CHECK(has(refusal(Status::kBadStates, [&](BatchInput& in) { in.states.poses = other.data(); }), "poses"));
  CHECK(has(refusal(Status::kBadStates, [&](BatchInput& in) { in.poses.link_stride = 32; }), "poses"));
  CHECK(
      has(refusal(Status::kBadStates, [&](BatchInput& in) { in.poses.format = PoseFormat::kMatrix3x4Rows; }), "poses"));
  CHECK(has(refusal(Status::kBadJoint, [&](BatchInput& in) { in.states.kinematics = &of_broken; }), "kinematics"));
}

TEST_CASE("poses of states have the same bits on every instruction set, one by one or together") {
  for (std::uint64_t seed = 1; seed <= rounds(60); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    const JointedBody body = random_joints(random, 20);
    const std::size_t count = random.index(40), floats = 7 * body.links.size();
    std::vector<double> states(count * body.variable_count);
    for (double& x : states) {
      x = random.uniform(-4, 4);
      if (random.chance(0.02)) x = random.chance(0.5) ? 0 : x * random.log_uniform(1e-300, 1e300);
      if (random.chance(0.005)) x = std::numeric_limits<double>::infinity();
      if (random.chance(0.005)) x = std::numeric_limits<double>::quiet_NaN();
    }
    std::vector<float> expected(count * floats);
    require(compute_link_poses(body.desc(), states, Isa::kScalar, expected));
    for (const Isa isa : available_isas()) {
      CAPTURE(to_string(isa));
      std::vector<float> found(count * floats), alone(floats);
      require(compute_link_poses(body.desc(), states, isa, found));
      const auto same = [](const float* a, const float* b, std::size_t n) {
        return std::equal(a, a + n, b, [](float x, float y) {
          return std::memcmp(&x, &y, sizeof x) == 0 || (std::isnan(x) && std::isnan(y));
        });
      };
      CHECK(same(found.data(), expected.data(), found.size()));
      for (std::size_t s = 0; s < count; ++s) {
        const Span<const double> one = {states.data() + s * body.variable_count, body.variable_count};
        require(compute_link_poses(body.desc(), one, isa, alone));
        CHECK(same(alone.data(), expected.data() + s * floats, floats));
      }
    }
  }
}

TEST_CASE("angles of any size are taken modulo two turns") {
  JointedBody body;
  body.parents = {-1};
  body.links.resize(1);
  body.links[0].joint_count = 1;
  body.joints.resize(1);
  body.variable_count = 1;
  for (const double angle : {2e6, -3.7e9, 1e22, 1.7e308}) {
    const double left = std::fmod(angle, 12.566370614359172);
    std::vector<float> far(7), near(7);
    require(compute_link_poses(body.desc(), {&angle, 1}, Isa::kAuto, far));
    require(compute_link_poses(body.desc(), {&left, 1}, Isa::kAuto, near));
    CHECK(far == near);
    CHECK(std::fabs(far[2] - static_cast<float>(std::sin(left / 2))) < 1e-6f);
  }
}

TEST_CASE("a place that is turned by a hair is turned, even if its quaternion is a little too long") {
  JointedBody body;
  body.parents = {-1};
  body.links.resize(1);
  body.links[0].rotation[0] = 5e-4;
  body.variable_count = 1;
  const double state = 0;
  std::vector<float> pose(7);
  require(compute_link_poses(body.desc(), {&state, 1}, Isa::kAuto, pose));
  CHECK(pose[0] == 5e-4f);
}

TEST_CASE("a body that is refused, or arrays that do not fit, have their status, and nothing is written") {
  const std::vector<double> states(8, 0.5);
  const auto run = [](const JointedBody& body, Span<const double> of, std::size_t floats) {
    std::vector<float> poses(floats, 7.0f);
    const Status status = compute_link_poses(body.desc(), of, Isa::kAuto, poses);
    const bool is_written = std::any_of(poses.begin(), poses.end(), [](float x) { return x != 7.0f; });
    CHECK(is_written == (status == Status::kOk && floats > 0));
    return status;
  };
  CHECK(run(two_links(), states, 28) == Status::kOk);
  for (const Fault& fault : kFaults) {
    CAPTURE(fault.what);
    JointedBody body = two_links();
    fault.plant(body);
    CHECK(run(body, states, 28) == fault.status);
  }
  CHECK(run(two_links(), states, 27) == Status::kBadOutput);
  CHECK(run(two_links(), states, 14) == Status::kBadOutput);
  CHECK(run(two_links(), {states.data(), 7}, 28) == Status::kBadOutput);
  CHECK(run(two_links(), {nullptr, 8}, 28) == Status::kBadOutput);
  CHECK(run(two_links(), {}, 0) == Status::kOk);
  const JointedBody body = two_links();
  CHECK(compute_link_poses(body.desc(), states, Isa::kAuto, {nullptr, 28}) == Status::kBadOutput);
  std::vector<float> poses(28);
  CHECK(compute_link_poses(body.desc(), states, static_cast<Isa>(kIsaCount + 1), poses) == Status::kIsaNotAvailable);
}

}  // namespace cab::tests
