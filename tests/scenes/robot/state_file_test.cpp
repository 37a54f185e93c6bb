// Joint states from CSV: values reach the variables that the header names, and bad lines are refused by their number.
#include "scenes/robot/state_file.h"

#include "scenes/import/limits.h"
#include "scenes/robot/robot_payload.h"
#include "tests/scenes/temporary_file.h"

#include <doctest/doctest.h>

#include <string>
#include <vector>

namespace cab::tests {
namespace {

scenes::Robot two_joints() {
  scenes::Robot robot;
  robot.variables = {{"a", -1, 1, .5}, {"b", 0, 2, 0}};
  scenes::RobotJoint follower;
  follower.name = "c";
  robot.joints = {follower};
  return robot;
}

scenes::JointStates read(const std::string& text) {
  const TemporaryFile file("states.csv", text);
  const scenes::JointStates states = scenes::read_joint_states(file.path(), two_joints(), {});
  const scenes::JointStates same = scenes::read_joint_states(file.path(), two_joints(), scenes::kImportSandbox);
  CHECK(scenes::joint_states_payload(same) == scenes::joint_states_payload(states));
  return states;
}

}  // namespace

TEST_CASE("columns may come in any order, what has no column rests, comments and empty lines are passed over") {
  const scenes::JointStates both = read("# recorded\n\n b , a\r\n1.5, -1e-1\n\n2,1");
  CHECK(both.count == 2);
  CHECK(both.values == std::vector<double>{-.1, 1.5, 1, 2});
  CHECK(both.notes.empty());
  CHECK(read("\xef\xbb\xbf"
             "b,a\n1.5,-.1\n")
            .values == std::vector<double>{-.1, 1.5});
  const scenes::JointStates one = read("b,c\n1,7\n");
  CHECK(one.values == std::vector<double>{.5, 1});
  REQUIRE(one.notes.size() == 2);
  CHECK(one.notes[0].find("the column of c is not used") != std::string::npos);
  CHECK(one.notes[1].find("1 joints without a column stay at rest") != std::string::npos);
  const scenes::JointStates beyond = read("a\n0\n-3\n4\n");
  REQUIRE(beyond.notes.size() == 2);
  CHECK(beyond.notes[1].find("2 values are beyond a joint's limit, the first in line 3, joint a") != std::string::npos);
}

TEST_CASE("a bad line of joint states is refused by its number and the reason") {
  const std::vector<std::pair<std::string, std::string>> bad = {
      {"\n# only\n", "no line with the names of joints"},
      {"a,b\n", "no joint state below the line of names"},
      {"a,d\n1,2\n", "line 1: the robot has no joint 'd' that moves"},
      {"\na,a\n1,2\n", "line 2: the joint a has two columns"},
      {"a,b\n1,2\n3\n", "line 3: 1 values for 2 columns"},
      {"a,b\n1,2,3\n", "line 2: 3 values for 2 columns"},
      {"a\n1x\n", "line 2: '1x' is not a number from -1e9 to 1e9"},
      {"a\nnan\n", "line 2: 'nan' is not a number"},
      {"a,b\n1,\n", "line 2: '' is not a number"},
      {"a\n2e9\n", "line 2: '2e9' is not a number"},
  };
  for (const auto& one : bad) {
    CAPTURE(one.first);
    CHECK_THROWS_WITH_AS(read(one.first), doctest::Contains(one.second.c_str()), scenes::ImportError);
  }
}

}  // namespace cab::tests
