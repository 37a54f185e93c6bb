// Adjacent links: those that a joint connects, over links without shapes and one joint that moves at most, and those of
// one rigid body.
#include "scenes/robot/adjacency.h"

#include "tests/scenes/temporary_file.h"

#include <doctest/doctest.h>

#include <set>
#include <string>
#include <utility>

namespace cab::tests {
namespace {

using Names = std::set<std::pair<std::string, std::string>>;

Names adjacent(const std::string& text, const std::string& file_name = "r.urdf") {
  const TemporaryFile file(file_name, text);
  const scenes::Robot robot = scenes::import_robot(file.path(), {});
  Names names;
  for (const LinkPair& pair : scenes::adjacent_pairs(robot)) {
    CHECK(pair.a < pair.b);
    names.emplace(robot.body.link_names[pair.a], robot.body.link_names[pair.b]);
  }
  return names;
}

// A link that has a shape if its name is in capitals, and the joint above it: 'm' moves, 'f' is fixed, 'p' floats.
std::string link(const std::string& name, char joint = ' ', const std::string& parent = "") {
  const bool shaped = name[0] >= 'A' && name[0] <= 'Z';
  std::string text = "<link name='" + name + "'>" +
                     (shaped ? "<collision><geometry><sphere radius='1'/></geometry></collision>" : "") + "</link>\n";
  if (joint == ' ') return text;
  const std::string type = joint == 'm' ? "revolute" : joint == 'f' ? "fixed" : "floating";
  return text + "<joint name='j" + name + "' type='" + type + "'><parent link='" + parent + "'/><child link='" + name +
         "'/><limit lower='-1' upper='1'/></joint>\n";
}

std::string robot(const std::string& links) { return "<robot name='r'>\n" + links + "</robot>"; }

}  // namespace

TEST_CASE("links without shapes pass adjacency on over one joint that moves at most, and the world passes none") {
  // The two tools of a robot with two arms: four joints that move lie between them.
  CHECK(adjacent(robot(link("torso") + link("l1", 'm', "torso") + link("l2", 'm', "l1") + link("L", 'f', "l2") +
                       link("r1", 'm', "torso") + link("r2", 'm', "r1") + link("R", 'f', "r2"))) == Names{});
  CHECK(adjacent(robot(link("A") + link("b", 'm', "A") + link("C", 'f', "b"))) == Names{{"A", "C"}});
  CHECK(adjacent(robot(link("A") + link("b", 'f', "A") + link("c", 'f', "b") + link("D", 'm', "c"))) ==
        Names{{"A", "D"}});
  CHECK(adjacent(robot(link("A") + link("b", 'm', "A") + link("C", 'm', "b"))) == Names{});
  CHECK(adjacent(robot(link("A") + link("B", 'm', "A") + link("C", 'm', "B"))) == Names{{"A", "B"}, {"B", "C"}});
  // Two on one link without a shape: one joint moves, then two.
  CHECK(adjacent(robot(link("A") + link("b", 'm', "A") + link("C", 'f', "b") + link("D", 'm', "b"))) ==
        Names{{"A", "C"}, {"C", "D"}});
  CHECK(adjacent(robot(link("world") + link("A", 'm', "world") + link("B", 'm', "world"))) == Names{});
  CHECK(adjacent(robot(link("world") + link("A", 'f', "world") + link("B", 'm', "world"))) == Names{});
  CHECK(adjacent(robot(link("world") + link("base", 'f', "world") + link("A", 'f', "base") + link("B", 'm', "base"))) ==
        Names{{"A", "B"}});
  CHECK(adjacent(robot(link("A") + link("B", 'p', "A") + link("c", 'p', "B") + link("D", 'f', "c"))) == Names{});
}

TEST_CASE("links welded to each other are adjacent, over others and over the world too") {
  CHECK(adjacent(robot(link("A") + link("B", 'f', "A") + link("C", 'f', "B") + link("D", 'm', "C"))) ==
        Names{{"A", "B"}, {"A", "C"}, {"B", "C"}, {"C", "D"}});
  CHECK(adjacent(robot(link("world") + link("A", 'f', "world") + link("b", 'f', "world") + link("C", 'f', "b"))) ==
        Names{{"A", "C"}});
}

TEST_CASE("bodies of MJCF on a world without shapes are not adjacent to each other") {
  if (!scenes::reads_mjcf()) {
    MESSAGE("skipped: libmujoco is not built in");
    return;
  }
  CHECK(adjacent("<mujoco><worldbody><body name='a'><joint/><geom size='.1'/></body>"
                 "<body name='b'><joint/><geom size='.1'/></body></worldbody></mujoco>",
                 "r.xml") == Names{});
}

}  // namespace cab::tests
