// why_masked: the link, the number and how far off it is.
#include "perf/harness/random_world.h"
#include "perf/harness/world.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>

namespace cab::tests {
namespace {

using namespace cab::oracle;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

// Five instances of three links in a row with a leaf each.
struct Body {
  Rig rig;
  Poses poses;
  EnginePtr engine;

  Body(PoseFormat format, bool orientations) {
    Random random(3);
    for (std::uint32_t link = 0; link < 3; ++link) {
      rig.parents.push_back(static_cast<std::int32_t>(link) - 1);
      rig.parent_offset.push_back({{0.3, 0, 0}});
      rig.leaves.push_back({link, random_box(random, {}, 0.1, 0.2), {}});
    }
    poses = random_poses(random, rig, 5, format, {1, orientations, false, {}});
    engine = make_engine();
    add_instances(*engine, add_rig(*engine, rig), 5);
  }

  MaskReason reason(std::uint32_t instance) {
    MaskReason out;
    REQUIRE(why_masked(*engine, poses.input({1}), instance, &out) == Status::kOk);
    return out;
  }

  // The flags that a frame gives.
  std::vector<std::uint8_t> flags() {
    World world;
    world.members.push_back({rig, poses});
    world.rules = {{{1}, {1}, Pairing::kBetween}};
    return run_world(world).flags[0];
  }
};

}  // namespace

TEST_CASE("a sound instance is masked for no reason") {
  for (const PoseFormat format :
       {PoseFormat::kQuaternionTranslation, PoseFormat::kMatrix3x4Rows, PoseFormat::kMatrix4x4Columns}) {
    Body body(format, true);
    for (std::uint32_t i = 0; i < 5; ++i) {
      CHECK(body.reason(i).cause == MaskCause::kNone);
      CHECK(body.reason(i).flag == kInstanceOk);
    }
  }
}

TEST_CASE("the number at fault is named, with its link and its value") {
  Body body(PoseFormat::kQuaternionTranslation, true);
  body.poses.pose(1, 2)[5] = 3e18f;
  body.poses.pose(2, 1)[0] = kNan;
  body.poses.orientations[4 * 3 + 2] = -std::numeric_limits<float>::infinity();
  const MaskReason large = body.reason(1), nan = body.reason(2), orientation = body.reason(3);
  CHECK(large.flag == kInstanceNotFinite);
  CHECK(large.cause == MaskCause::kPoseNumber);
  CHECK(large.link == 2);
  CHECK(large.index == 5);
  CHECK(large.value == 3e18f);
  CHECK(large.limit == kMaxCoordinate);
  CHECK(nan.cause == MaskCause::kPoseNumber);
  CHECK(nan.link == 1);
  CHECK(nan.index == 0);
  CHECK(std::isnan(nan.value));
  CHECK(orientation.cause == MaskCause::kOrientationNumber);
  CHECK(orientation.index == 2);
  CHECK(body.reason(0).cause == MaskCause::kNone);
  CHECK(body.flags() == std::vector<std::uint8_t>{0, kInstanceNotFinite, kInstanceNotFinite, kInstanceNotFinite, 0});
}

TEST_CASE("a rotation at fault is named, with how far off it is") {
  Body quaternions(PoseFormat::kQuaternionTranslation, true);
  for (int c = 0; c < 4; ++c) {
    quaternions.poses.pose(0, 1)[c] = c == 3 ? 2000.0f : 0.0f;
    quaternions.poses.orientations[4 + static_cast<std::size_t>(c)] = 0;
  }
  const MaskReason long_one = quaternions.reason(0), zero = quaternions.reason(1);
  CHECK(long_one.flag == kInstanceNotRigid);
  CHECK(long_one.cause == MaskCause::kQuaternionLength);
  CHECK(long_one.link == 1);
  CHECK(long_one.value == doctest::Approx(2000));
  CHECK(long_one.limit == doctest::Approx(1000));
  CHECK(zero.cause == MaskCause::kOrientationLength);
  CHECK(zero.value == 0);
  CHECK(zero.limit == doctest::Approx(1e-3));
  CHECK(quaternions.flags()[0] == kInstanceNotRigid);
  CHECK(quaternions.flags()[1] == kInstanceNotRigid);

  for (const PoseFormat format : {PoseFormat::kMatrix3x4Rows, PoseFormat::kMatrix4x4Columns}) {
    Body matrices(format, false);
    float* const pose = matrices.poses.pose(4, 2);
    for (std::size_t c = 0; c < 3; ++c) pose[format == PoseFormat::kMatrix3x4Rows ? 4 * c : c] *= 1.1f;
    if (format == PoseFormat::kMatrix4x4Columns)
      matrices.poses.pose(3, 0)[3] = kNan;  // of the last row, which is not read
    const MaskReason scaled = matrices.reason(4);
    CHECK(scaled.flag == kInstanceNotRigid);
    CHECK(scaled.cause == MaskCause::kMatrix);
    CHECK(scaled.link == 2);
    CHECK(scaled.value == doctest::Approx(0.21).epsilon(0.001));
    CHECK(scaled.limit == doctest::Approx(1e-3));
    CHECK(matrices.reason(3).cause == MaskCause::kNone);
    CHECK(matrices.flags() == std::vector<std::uint8_t>{0, 0, 0, 0, kInstanceNotRigid});
  }
}

TEST_CASE("a box or a joint that leaves the range is named") {
  Body body(PoseFormat::kQuaternionTranslation, false);
  body.rig.leaves[1].box.half[0] = 1e18f;
  body.engine = make_engine();
  add_instances(*body.engine, add_rig(*body.engine, body.rig), 5);
  for (std::uint32_t link = 0; link < 3; ++link) body.poses.pose(2, link)[6] = 9.99e17f;
  const MaskReason box = body.reason(2);
  CHECK(box.flag == kInstanceNotFinite);
  CHECK(box.cause == MaskCause::kBox);
  CHECK(box.link == 1);
  CHECK(box.index == 1);
  CHECK(box.value > kMaxCoordinate);
  CHECK(body.flags()[2] == kInstanceNotFinite);

  Body joints(PoseFormat::kQuaternionTranslation, false);
  joints.rig.joints.assign(9, 0.0f);
  joints.rig.joints[3] = 9e17f;
  joints.engine = make_engine();
  add_instances(*joints.engine, add_rig(*joints.engine, joints.rig), 5);
  for (int c = 0; c < 7; ++c) joints.poses.pose(0, 1)[c] = c == 3 ? 1.0f : c == 4 ? 9e17f : 0.0f;
  const MaskReason joint = joints.reason(0);
  CHECK(joint.cause == MaskCause::kJoint);
  CHECK(joint.link == 1);
  CHECK(joint.value == doctest::Approx(1.8e18));
  CHECK(joints.flags()[0] == kInstanceNotFinite);
}

TEST_CASE("the flag of the reason is the flag of the frame, for random faults") {
  std::size_t masked = 0;
  for (std::uint64_t seed = 1; seed <= rounds(60); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    const PoseFormat format = static_cast<PoseFormat>(random.index(3));
    Body body(format, random.chance(0.5));
    for (std::uint32_t i = 0; i < 5; ++i)
      for (std::uint32_t fault = random.index(3); fault > 0; --fault) {
        float* const pose = body.poses.pose(i, random.index(3));
        float& number = pose[random.index(static_cast<unsigned>(body.poses.floats_per_pose()))];
        number = random.chance(0.3) ? kNan : number * static_cast<float>(random.log_uniform(0.99, 1e19));
      }
    const std::vector<std::uint8_t> flags = body.flags();
    for (std::uint32_t i = 0; i < 5; ++i) {
      const MaskReason reason = body.reason(i);
      CHECK(reason.flag == flags[i]);
      CHECK((reason.cause == MaskCause::kNone) == (flags[i] == kInstanceOk));
      masked += flags[i] != kInstanceOk;
    }
  }
  CHECK(masked >= least_count(60, 60));
}

TEST_CASE("a question about no instance, or without an answer to write, is refused") {
  Body body(PoseFormat::kQuaternionTranslation, false);
  MaskReason out;
  CHECK(why_masked(*body.engine, body.poses.input({1}), 5, &out) == Status::kBadInstance);
  CHECK(why_masked(*body.engine, body.poses.input({1}), 0, nullptr) == Status::kBadOutput);
  CHECK(why_masked(*body.engine, body.poses.input({2}), 0, &out) == Status::kUnknownBatch);
}

}  // namespace cab::tests
