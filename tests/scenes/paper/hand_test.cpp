// The hand of Table 5: bodies, joints, motion, and the counts that follow from the leaf boxes.
#include "scenes/paper/hand.h"

#include "scenes/paper/superellipsoid.h"
#include "tests/scenes/paper/leaf_boxes.h"

#include <doctest/doctest.h>

#include <cmath>
#include <string>
#include <vector>

using namespace cab::tests;

namespace {

constexpr double kTilt = .146;
constexpr std::uint32_t kBallLink = 0;

// The bodies of the hand, written down independently: parent, half extents, and the place of the joint in the parent's
// centred frame.
struct Body {
  std::string name;
  int parent;
  Vec3 half;
  Vec3 joint_in_parent;
};
const std::vector<Body> kBodies = {
    {"forearm", -1, {7, 3, 2.4}, {}},
    {"palm", 0, {5, 4.2, 1.4}, {7, 0, 0}},
    {"thumb metacarpal", 1, {2.4, 1.3, 1.2}, {-3.5, 2.5, 0}},
    {"thumb 1", 2, {2.3, .9, .85}, {2.4, 0, 0}},
    {"thumb 2", 3, {1.6, .8, .75}, {2.3, 0, 0}},
    {"thumb 3", 4, {1.3, .7, .65}, {1.6, 0, 0}},
    {"index 1", 1, {2.15, .9, .85}, {5, 3.4, 0}},
    {"index 2", 6, {1.3, .8, .75}, {2.15, 0, 0}},
    {"index 3", 7, {1.1, .7, .65}, {1.3, 0, 0}},
    {"middle 1", 1, {2.4, .9, .85}, {5, 1.2, 0}},
    {"middle 2", 9, {1.5, .8, .75}, {2.4, 0, 0}},
    {"middle 3", 10, {1.15, .7, .65}, {1.5, 0, 0}},
    {"ring 1", 1, {2.2, .9, .85}, {5, -1, 0}},
    {"ring 2", 12, {1.4, .8, .75}, {2.2, 0, 0}},
    {"ring 3", 13, {1.15, .7, .65}, {1.4, 0, 0}},
    {"little 1", 1, {1.7, .9, .85}, {5, -3.2, 0}},
    {"little 2", 15, {1.05, .8, .75}, {1.7, 0, 0}},
    {"little 3", 16, {1, .7, .65}, {1.05, 0, 0}},
};

}  // namespace

TEST_CASE("the hand has 18 bodies that stay at the joints of their parents in every frame") {
  const Scene scene = make_hand(4001);
  REQUIRE(scene.characters.size() == 5);
  const Character& hand = scene.characters[0];
  REQUIRE(kBodies.size() == 18);
  REQUIRE(hand.link_parents.size() == kBodies.size());
  // Worst measured 1.9e-6, from floats of coordinates below 32.
  constexpr double kJointTolerance = 1e-5;
  for (std::size_t link = 0; link < kBodies.size(); ++link) {
    const Body& body = kBodies[link];
    CAPTURE(body.name);
    CHECK(hand.link_names[link] == body.name);
    CHECK(hand.link_parents[link] == body.parent);
    for (std::size_t k = 0; k < 3; ++k) CHECK(hand.leaves[link].box.half[k] == static_cast<float>(body.half[k]));
    CHECK(hand.link_joints[3 * link] == static_cast<float>(-body.half[0]));
    CHECK(hand.link_joints[3 * link + 1] == 0);
    CHECK(hand.link_joints[3 * link + 2] == 0);
    REQUIRE(hand.leaves[link].parts.size() == 1);
    CHECK(hand.leaves[link].parts[0].vertices == superellipsoid(body.half[0], body.half[1], body.half[2], 1));
    if (body.parent < 0) continue;
    double worst = 0;
    for (std::uint32_t f = 0; f < scene.frame_count; ++f) {
      const Vec3 joint = placed(hand, f, link).to_world({-body.half[0], 0, 0});
      const PlacedBox parent = placed(hand, f, static_cast<std::size_t>(body.parent));
      worst = std::max(worst, length(joint - parent.to_world(body.joint_in_parent)));
    }
    CHECK(worst < kJointTolerance);
  }
}

TEST_CASE("the hand's bodies stand in frame 0 where the equations put them") {
  // t = 0 before the tilt: o = (0, 0, 8.56), pitch -.453 + .12 sin .4 = -.4062698, yaw .218, so that
  // F0 = (.8968598, .1986727, .3951855), F1 = (-.2162774, .9763320, 0). The middle finger's curl is .923; it rotates
  // by .9 .923 (.8, 1, 1); the thumb's is .923 + .744 .35 = 1.1834; it rotates by .35 1.1834 (.8, 1, 1).
  const Scene scene = make_hand(1);
  const auto center = [&scene](std::size_t link) { return placed(scene.characters[0], 0, link).center; };
  CHECK(length(center(0) - tilted_by(kTilt, {-6.2780188, -1.3907089, 5.7937014})) < 2e-6);
  CHECK(length(center(1) - tilted_by(kTilt, {4.4842992, .9933635, 10.5359276})) < 2e-6);
  CHECK(length(center(2) - tilted_by(kTilt, {1.7359909, 4.8707206, 9.7423413})) < 2e-6);
  CHECK(length(center(5) - tilted_by(kTilt, {6.0337496, 15.0220651, 10.0177005})) < 2e-6);
  CHECK(length(center(11) - tilted_by(kTilt, {14.1832813, 4.5027266, 7.5455922})) < 2e-6);
}

TEST_CASE("the ball lies on the table, rolls out in the last fifth of the flick and comes back") {
  const Scene scene = make_hand(300);
  const Character& ball = scene.characters[1];
  CHECK_FALSE(ball.is_static);
  REQUIRE(ball.leaves.size() == 1);
  CHECK(ball.leaves[0].parts[0].vertices == superellipsoid(4, 4, 4, 1));
  const auto off = [&ball](std::uint32_t frame, const Vec3& expected) {
    return length(placed(ball, frame, kBallLink).center - tilted_by(kTilt, expected));
  };
  CHECK(off(0, {16.223, .5, 4}) < 2e-6);
  CHECK(off(180, {16.223, 1.5 * std::sin(1.5) + .5, 4}) < 2e-6);
  // Halfway through the last fifth, at t = 3.6, the ball is at 16.223 + 14.203 - 8.
  CHECK(off(216, {22.426, 1.5 * std::sin(1.8) + .5, 4}) < 4e-6);
  CHECK(off(240, {16.223, 1.5 * std::sin(2.0) + .5, 4}) < 4e-6);
}

TEST_CASE("table and rails stand still, tilted with the world, and are exact boxes") {
  const Scene scene = make_hand(10);
  const Vec3 centers[3] = {{10, 0, -2}, {30.426, 0, 4}, {-22.573, 0, 4}};
  const Vec3 halves[3] = {{40, 30, 2}, {1, 30, 4}, {1, 30, 4}};
  for (std::size_t object = 0; object < 3; ++object) {
    const Character& fixture = scene.characters[object + 2];
    CAPTURE(fixture.name);
    CHECK(fixture.is_static);
    CHECK(fixture.poses.size() == 12);
    REQUIRE(fixture.leaves.size() == 1);
    CHECK(fixture.leaves[0].parts.empty());
    const PlacedBox box = placed(fixture, 9, 0);
    CHECK(box.half == halves[object]);
    CHECK(length(box.center - tilted_by(kTilt, centers[object])) < 2e-6);
    for (std::size_t k = 0; k < 3; ++k) {
      Vec3 axis = {0, 0, 0};
      axis[k] = 1;
      CHECK(length(box.axes[k] - tilted_by(kTilt, axis)) < 1e-7);
    }
  }
}

TEST_CASE("the leaf boxes of the hand, the ball, the table and the rails have the known counts of overlaps") {
  // The counts of bounds also show that the thumb rotates by .4 about axis 0 of the palm. About axis 0 of the
  // metacarpal the count of boxes would be the same, but the counts of bounds would be 31044 and 20372.
  const Scene scene = make_hand(4001);
  CHECK(count_box_overlaps(scene) == 10602);
  CHECK(count_box_bounds_overlaps(scene) == 29986);
  CHECK(count_vertex_bounds_overlaps(scene) == 19614);
}
