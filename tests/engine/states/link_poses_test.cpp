// compute_link_poses: the same bits on every instruction set and in any division of states, and a status per fault.
#include "perf/harness/random_joints.h"
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

}  // namespace

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
