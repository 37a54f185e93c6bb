// Robots, disabled pairs and joint states as bytes: whole after their way through them, refused where an index or a
// number is none of the robot's.
#include "scenes/robot/robot_payload.h"

#include "scenes/sandbox/payload.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <limits>

namespace {

using namespace cab;
using namespace cab::scenes;

Robot made_robot() {
  Robot robot;
  robot.body.name = "made";
  robot.body.link_names = {"base", "arm"};
  robot.body.link_parents = {-1, 0};
  BodyLeaf leaf;
  leaf.link = 1;
  leaf.box = {{1, 2, 3}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {4, 5, 6}};
  leaf.parts.resize(2);
  leaf.parts[0].shape.kind = ShapeKind::kCapsule;
  leaf.parts[0].shape.position[2] = 7;
  leaf.parts[0].shape.size[1] = 8;
  leaf.parts[1].shape.kind = ShapeKind::kConvexHull;
  leaf.parts[1].vertices = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  robot.body.leaves = {leaf};
  robot.body.ignored_pairs = {{0, 1}};
  robot.links.resize(2);
  robot.links[1].place = {{0, 0, 1, 0}, {1, 2, 3}};
  robot.links[1].joint_count = 1;
  robot.links[1].floats = true;
  robot.links[1].welded = true;
  robot.joints = {{"ball", JointKind::kBall, {1, 0, 0}, {0, 1, 2}, 0, 2, .5}};
  robot.variables = {{"ball.x", -1, 1, 0}, {"ball.y", -2, 2, .5}, {"ball.z", -3, 3, 1}};
  robot.leaf_sources = {"r.urdf: line 3"};
  robot.left_out = {1, 2, 3};
  robot.notes = {"one", "two"};
  return robot;
}

// A robot's payload after a change to the robot.
template <class Change>
std::string changed(Change change) {
  Robot robot = made_robot();
  change(robot);
  return robot_payload(robot);
}

}  // namespace

TEST_CASE("a robot is the same after its way through bytes") {
  const Robot made = made_robot(), read = read_robot_payload(robot_payload(made));
  CHECK(read.body.name == made.body.name);
  CHECK(read.body.link_names == made.body.link_names);
  CHECK(read.body.link_parents == made.body.link_parents);
  REQUIRE(read.body.leaves.size() == 1);
  CHECK(read.body.leaves[0].link == 1);
  CHECK(read.body.leaves[0].box.center[2] == 3);
  CHECK(read.body.leaves[0].box.axis[1][1] == 1);
  CHECK(read.body.leaves[0].box.half[2] == 6);
  REQUIRE(read.body.leaves[0].parts.size() == 2);
  CHECK(read.body.leaves[0].parts[0].shape.kind == ShapeKind::kCapsule);
  CHECK(read.body.leaves[0].parts[0].shape.position[2] == 7);
  CHECK(read.body.leaves[0].parts[0].shape.rotation[3] == 1);
  CHECK(read.body.leaves[0].parts[0].shape.size[1] == 8);
  CHECK(read.body.leaves[0].parts[1].vertices == made.body.leaves[0].parts[1].vertices);
  REQUIRE(read.body.ignored_pairs.size() == 1);
  CHECK(read.body.ignored_pairs[0].b == 1);
  REQUIRE(read.links.size() == 2);
  CHECK(read.links[1].place.rotation == made.links[1].place.rotation);
  CHECK(read.links[1].place.translation == made.links[1].place.translation);
  CHECK(read.links[1].joint_count == 1);
  CHECK(read.links[1].floats);
  CHECK(read.links[1].welded);
  CHECK_FALSE(read.links[0].welded);
  REQUIRE(read.joints.size() == 1);
  CHECK(read.joints[0].name == "ball");
  CHECK(read.joints[0].kind == JointKind::kBall);
  CHECK(read.joints[0].axis == made.joints[0].axis);
  CHECK(read.joints[0].anchor == made.joints[0].anchor);
  CHECK(read.joints[0].multiplier == 2);
  CHECK(read.joints[0].offset == .5);
  REQUIRE(read.variables.size() == 3);
  CHECK(read.variables[1].name == "ball.y");
  CHECK(read.variables[1].lower == -2);
  CHECK(read.variables[1].upper == 2);
  CHECK(read.variables[1].rest == .5);
  CHECK(read.leaf_sources == made.leaf_sources);
  CHECK(read.left_out.shapes == 1);
  CHECK(read.left_out.joints == 2);
  CHECK(read.left_out.guesses == 3);
  CHECK(read.notes == made.notes);
  CHECK((robot_payload(read) == robot_payload(made)));
}

TEST_CASE("a robot with an index, a kind or a number that is none of its own is refused") {
  const auto refused = [](auto change) {
    const std::string bytes = changed(change);
    CHECK_THROWS_AS(read_robot_payload(bytes), PayloadError);
  };
  refused([](Robot& r) { r = {}; });
  refused([](Robot& r) { r.body.link_names.pop_back(); });
  refused([](Robot& r) { r.body.link_parents.pop_back(); });
  refused([](Robot& r) { r.body.link_parents[0] = 0; });
  for (const std::int32_t parent : {-2, -1, 1, 2}) refused([&](Robot& r) { r.body.link_parents[1] = parent; });
  refused([](Robot& r) { r.links.pop_back(); });
  refused([](Robot& r) { r.links[1].first_joint = 1; });
  refused([](Robot& r) { r.links[1].joint_count = 2; });
  refused([](Robot& r) { r.links[0].first_joint = 0xffffffffu, r.links[0].joint_count = 2; });
  refused([](Robot& r) { r.links[1].place.rotation[0] = std::numeric_limits<double>::quiet_NaN(); });
  refused([](Robot& r) { r.joints[0].variable = 1; });  // a ball has three
  refused([](Robot& r) { r.joints[0].variable = 0xfffffffeu; });
  refused([](Robot& r) { r.joints[0].kind = static_cast<JointKind>(3); });
  refused([](Robot& r) { r.joints[0].offset = std::numeric_limits<double>::infinity(); });
  refused([](Robot& r) { r.variables[2].upper = std::numeric_limits<double>::infinity(); });
  refused([](Robot& r) { r.body.leaves.clear(), r.leaf_sources.clear(); });
  refused([](Robot& r) { r.leaf_sources.clear(); });
  refused([](Robot& r) { r.body.leaves[0].link = 2; });
  refused([](Robot& r) { r.body.leaves[0].parts[0].shape.kind = static_cast<ShapeKind>(7); });
  refused([](Robot& r) { r.body.leaves[0].box.half[0] = std::numeric_limits<float>::quiet_NaN(); });
  refused([](Robot& r) { r.body.ignored_pairs[0].a = 2; });
  const std::string good = changed([](Robot&) {});
  for (std::size_t size = 0; size < good.size(); ++size)
    CHECK_THROWS_AS(read_robot_payload(good.substr(0, size)), PayloadError);
  CHECK_THROWS_AS(read_robot_payload(good + "x"), PayloadError);
}

TEST_CASE("texts of a robot that a child process sends are printed as one line") {
  const Robot read = read_robot_payload(changed([](Robot& r) {
    for (std::string* text : {&r.body.name, &r.body.link_names[0], &r.joints[0].name, &r.variables[0].name,
                              &r.leaf_sources[0], &r.notes[0]})
      *text = "fine\ncab: \x1b";
  }));
  for (const std::string& text : {read.body.name, read.body.link_names[0], read.joints[0].name, read.variables[0].name,
                                  read.leaf_sources[0], read.notes[0]})
    CHECK(text == "fine?cab: ?");
}

TEST_CASE("disabled pairs are the same after their way through bytes, and of links that the robot has") {
  const Robot robot = made_robot();
  DisabledPairs disabled = {{{0, 1}}, {"no link hand"}};
  const DisabledPairs read = read_disabled_pairs_payload(disabled_pairs_payload(disabled), robot);
  REQUIRE(read.pairs.size() == 1);
  CHECK(read.pairs[0].a == 0);
  CHECK(read.pairs[0].b == 1);
  CHECK(read.notes == disabled.notes);
  disabled.pairs[0].b = 2;
  CHECK_THROWS_AS(read_disabled_pairs_payload(disabled_pairs_payload(disabled), robot), PayloadError);
}

TEST_CASE("triangles are the same after their way through bytes, whole and with finite corners") {
  LeafTriangles triangles = {{}, std::vector<float>(18, 1.f)};
  CHECK(read_triangles_payload(triangles_payload(triangles)) == triangles);
  triangles[1][17] = std::numeric_limits<float>::infinity();
  CHECK_THROWS_AS(read_triangles_payload(triangles_payload(triangles)), PayloadError);
  triangles[1].pop_back();
  CHECK_THROWS_AS(read_triangles_payload(triangles_payload(triangles)), PayloadError);
}

TEST_CASE("joint states are the same after their way through bytes, with one finite value per variable") {
  const Robot robot = made_robot();
  const JointStates states = {{1, 2, 3, 4, 5, 6}, 2, {"two"}};
  const JointStates read = read_joint_states_payload(joint_states_payload(states), robot);
  CHECK(read.values == states.values);
  CHECK(read.count == 2);
  CHECK(read.notes == states.notes);
  const auto refused = [&](auto change) {
    JointStates bad = states;
    change(bad);
    CHECK_THROWS_AS(read_joint_states_payload(joint_states_payload(bad), robot), PayloadError);
  };
  refused([](JointStates& s) { s.values.pop_back(); });
  refused([](JointStates& s) { s.count = 3; });
  refused([](JointStates& s) { s = {}; });
  refused([](JointStates& s) { s.values[0] = std::numeric_limits<double>::quiet_NaN(); });
}
