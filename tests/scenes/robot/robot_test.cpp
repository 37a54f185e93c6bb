// Robots from files: shapes, joints and excluded pairs are as written, and bad files give one line that says where and
// why.
#include "scenes/robot/robot.h"

#include "scenes/import/limits.h"
#include "scenes/robot/robot_payload.h"

#include "scenes/random.h"
#include "tests/scenes/temporary_file.h"

#include <unistd.h>

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace cab::tests {
namespace {

namespace fs = std::filesystem;

const std::string kBox = "<collision><geometry><box size='1 2 3'/></geometry></collision>";

std::string robot_of(const std::string& inside) { return "<robot name='r'>\n" + inside + "\n</robot>\n"; }

// A link with one collision shape.
std::string link_of(const std::string& geometry, const std::string& more = "") {
  return "<link name='a'><collision>" + more + "<geometry>" + geometry + "</geometry></collision></link>";
}

// Two links and a joint with these attributes and elements.
std::string jointed(const std::string& type, const std::string& inside) {
  return robot_of("<link name='a'>" + kBox + "</link>\n<link name='b'>" + kBox + "</link>\n<joint name='j' type='" +
                  type + "'><parent link='a'/><child link='b'/>" + inside + "</joint>");
}

// What a refused text gives as its one line, without the path of the file; empty if it is read.
std::string refusal(const std::string& text, const scenes::RobotOptions& options = {},
                    const std::string& name = "bad.urdf") {
  const TemporaryFile file(name, text);
  try {
    scenes::import_robot(file.path(), options);
  } catch (const scenes::ImportError& error) {
    const std::string what = error.what();
    CHECK(what.find('\n') == std::string::npos);
    REQUIRE(what.rfind(file.path() + ": ", 0) == 0);
    return what.substr(file.path().size() + 2);
  }
  return {};
}

scenes::RobotOptions in_child(scenes::RobotOptions options = {}) {
  options.sandbox = scenes::kImportSandbox;
  return options;
}

bool same_robot(const scenes::Robot& a, const scenes::Robot& b) {
  return scenes::robot_payload(a) == scenes::robot_payload(b);
}

// Runs `work` and returns what it wrote to standard error below C++.
template <class Work>
std::string printed_by(Work work) {
  const TemporaryFile file("stderr", "");
  std::fflush(stderr);
  const int kept = dup(2);
  REQUIRE(std::freopen(file.path().c_str(), "w", stderr) != nullptr);
  work();
  std::fflush(stderr);
  dup2(kept, 2);
  close(kept);
  std::ifstream in(file.path());
  return {std::istreambuf_iterator<char>(in), {}};
}

// The text with one other piece in it.
std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  REQUIRE(at != std::string::npos);
  return text.replace(at, from.size(), to);
}

// A cube of edge 2 about the origin as OBJ.
std::string cube() {
  std::string text;
  for (int v = 0; v < 8; ++v)
    text += "v " + std::to_string(v & 1 ? 1 : -1) + " " + std::to_string(v & 2 ? 1 : -1) + " " +
            std::to_string(v & 4 ? 1 : -1) + "\n";
  return text + "f 1 2 4 3\nf 5 6 8 7\nf 1 2 6 5\nf 3 4 8 7\nf 1 3 7 5\nf 2 4 8 6\n";
}

std::array<double, 3> greatest(const std::vector<float>& vertices) {
  std::array<double, 3> most = {-1e30, -1e30, -1e30};
  for (std::size_t v = 0; v < vertices.size(); ++v)
    most[v % 3] = std::max(most[v % 3], static_cast<double>(vertices[v]));
  return most;
}

}  // namespace

TEST_CASE("shapes of URDF become leaves with the sizes and places of the file") {
  const TemporaryFile file("r.urdf", robot_of("<link name='a'>" + kBox +
                                              "<collision><origin xyz='1 2 3' rpy='0 0 1.5707963267948966'/><geometry>"
                                              "<cylinder radius='.5' length='4'/></geometry></collision>"
                                              "<collision><geometry><sphere radius='.25'/></geometry></collision>"
                                              "</link>"));
  const scenes::Robot robot = scenes::import_robot(file.path(), {});
  REQUIRE(robot.body.leaves.size() == 3);
  const ConvexPart& box = robot.body.leaves[0].parts[0].shape;
  CHECK(box.kind == ShapeKind::kBox);
  CHECK(box.size[0] == .5f);
  CHECK(box.size[1] == 1.f);
  CHECK(box.size[2] == 1.5f);
  const ConvexPart& cylinder = robot.body.leaves[1].parts[0].shape;
  CHECK(cylinder.kind == ShapeKind::kCylinder);
  CHECK(cylinder.size[0] == .5f);
  CHECK(cylinder.size[1] == 2.f);
  CHECK(cylinder.position[2] == 3.f);
  CHECK(cylinder.rotation[2] == doctest::Approx(std::sqrt(.5)));
  CHECK(robot.body.leaves[2].parts[0].shape.kind == ShapeKind::kSphere);
  CHECK(robot.body.leaves[2].parts[0].shape.size[0] == .25f);
  CHECK(robot.leaf_sources[1] == file.path() + ": line 2: link a: collision 2");
}

TEST_CASE("meshes are found by relative, file:// and package:// paths, scaled, and become hulls") {
  const TemporaryFile mesh("cube.obj", cube());
  const fs::path package = mesh.directory() / "my_robot";
  fs::create_directories(package / "urdf");
  fs::create_directories(package / "meshes");
  fs::copy_file(mesh.path(), package / "meshes/cube.obj");
  const auto read = [&](const std::string& name, const scenes::RobotOptions& options) {
    const std::string path = (package / "urdf/r.urdf").string();
    std::ofstream(path) << robot_of(
        link_of("<mesh filename='" + name + "' scale='1 -2 3'/>", "<origin xyz='10 0 0'/>"));
    const scenes::Robot robot = scenes::import_robot(path, options);
    CHECK(same_robot(robot, scenes::import_robot(path, in_child(options))));
    return robot;
  };
  scenes::RobotOptions named;
  named.packages = {{"other", package.string()}};
  const std::vector<std::pair<std::string, scenes::RobotOptions>> names = {
      {"../meshes/cube.obj", {}},
      {(package / "meshes/cube.obj").string(), {}},
      {"file://" + (package / "meshes/cube.obj").string(), {}},
      {"package://my_robot/meshes/cube.obj", {}},
      {"model://my_robot/meshes/cube.obj", {}},
      {"package://other/meshes/cube.obj", named}};
  for (const auto& way : names) {
    CAPTURE(way.first);
    const scenes::Robot robot = read(way.first, way.second);
    REQUIRE(robot.body.leaves.size() == 1);
    const scenes::ShapePart& part = robot.body.leaves[0].parts[0];
    CHECK(part.shape.kind == ShapeKind::kConvexHull);
    CHECK(part.vertices.size() == 24);
    CHECK(greatest(part.vertices) == std::array<double, 3>{11, 2, 3});
  }
  const std::string lost = "package://nowhere/meshes/cube.obj";
  try {
    read(lost, {});
    FAIL("a missing mesh is refused");
  } catch (const scenes::ImportError& error) {
    const std::string what = error.what();
    CHECK(what.find("r.urdf: line 2: link a: collision 1: mesh " + lost + ": no such file") != std::string::npos);
  }
  scenes::RobotOptions ball;
  ball.missing_mesh = scenes::MissingMesh::kBall;
  ball.ball_radius = .5;
  const scenes::Robot replaced = read(lost, ball);
  REQUIRE(replaced.body.leaves.size() == 1);
  CHECK(replaced.body.leaves[0].parts[0].shape.kind == ShapeKind::kSphere);
  CHECK(replaced.body.leaves[0].parts[0].shape.size[0] == .5f);
  CHECK(replaced.body.leaves[0].parts[0].shape.position[0] == 10.f);
  REQUIRE(replaced.notes.size() == 1);
  CHECK(replaced.notes[0].find(lost + " is missing: a ball stands for it") != std::string::npos);
  scenes::RobotOptions none;
  none.missing_mesh = scenes::MissingMesh::kLeaveOut;
  CHECK_THROWS_WITH_AS(read(lost, none), doctest::Contains("no link has a collision shape"), scenes::ImportError);
}

TEST_CASE("triangles of a mesh are those of its file, in the frame of the link, and other shapes have none") {
  const TemporaryFile mesh("roof.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nf 1 2 3 4\nf 1 2 5\n");
  const scenes::RobotOptions options;
  const auto check = [&](const std::string& name, const std::string& text, const std::vector<float>& expected) {
    CAPTURE(name);
    std::ofstream(mesh.directory() / name) << text;
    const std::string path = (mesh.directory() / name).string();
    const scenes::LeafTriangles triangles = scenes::import_triangles(path, options);
    CHECK(scenes::import_triangles(path, in_child(options)) == triangles);
    REQUIRE(triangles.size() == scenes::import_robot(path, options).body.leaves.size());
    REQUIRE(triangles.size() == 2);
    CHECK(triangles[0].empty());
    CHECK(triangles[1].size() == 27);  // the polygon is a fan of two
    for (const float x : expected)
      CHECK(std::any_of(triangles[1].begin(), triangles[1].end(), [x](float y) { return std::fabs(x - y) < 1e-5f; }));
  };
  // A shape of size 0 is no leaf.
  check("r.urdf",
        robot_of("<link name='a'>" + kBox + "<collision><geometry><sphere radius='0'/></geometry></collision>" +
                 "<collision><origin xyz='10 0 0'/><geometry><mesh filename='roof.obj' scale='2 3 4'/></geometry>" +
                 "</collision></link>"),
        {10, 12, 3, 4});
  if (!scenes::reads_mjcf()) return;
  check("r.xml",
        "<mujoco><asset><mesh name='m' file='roof.obj' scale='2 3 4'/></asset><worldbody><geom size='1'/><body>"
        "<geom type='mesh' mesh='m' pos='10 0 0'/></body></worldbody></mujoco>",
        {10, 12, 3, 4});
}

TEST_CASE("whatever is wrong with a mesh, the refusal names its file beside the line of the robot") {
  const std::string triangle = "v 0 0 0\nv 1 0 0\nv 0 X 0\nf 1 2 3\n";
  for (const auto& one : std::vector<std::pair<std::string, std::string>>{
           {"nothing", "assimp cannot read it: "},
           {"v 0 0 0\n", ""},
           {replaced(triangle, "X", "nan"), "a vertex is not a number"},
           {replaced(triangle, "X", "1e20"), "a vertex is not a number or out of range"}}) {
    CAPTURE(one.first);
    const TemporaryFile mesh("m.obj", one.first);
    const std::string robot = robot_of(link_of("<mesh filename='" + mesh.path() + "'/>"));
    const std::string line = refusal(robot);
    CAPTURE(line);
    CHECK(line.rfind("line 2: link a: collision 1: mesh " + mesh.path() + ": " + one.second, 0) == 0);
  }
  // What the engine refuses is told with the source of the leaf.
  const TemporaryFile mesh("m.obj", replaced(triangle, "X", "1"));
  const TemporaryFile file("r.urdf", robot_of(link_of("<mesh filename='" + mesh.path() + "'/>")));
  CHECK(scenes::import_robot(file.path(), {}).leaf_sources ==
        std::vector<std::string>{file.path() + ": line 2: link a: collision 1: mesh " + mesh.path()});
}

TEST_CASE("options of the other format are noted") {
  const auto notes = [](const std::string& text, const scenes::RobotOptions& options) {
    const TemporaryFile file("r.xml", text);
    return scenes::import_robot(file.path(), options).notes;
  };
  scenes::RobotOptions words, root, packages, missing;
  words.ignored_words = {"later"};
  root.root = "/";
  packages.packages = {{"arm", "/"}};
  missing.missing_mesh = scenes::MissingMesh::kLeaveOut;
  const std::string urdf = robot_of("<link name='a'>" + kBox + "</link>");
  for (const scenes::RobotOptions& options : {words, root})
    CHECK(notes(urdf, options) == std::vector<std::string>{"words to ignore and a root folder say nothing for URDF"});
  for (const scenes::RobotOptions& options : {packages, missing}) CHECK(notes(urdf, options).empty());
  if (!scenes::reads_mjcf()) return;
  const std::string mjcf = "<mujoco><worldbody><geom size='1'/></worldbody></mujoco>";
  for (const scenes::RobotOptions& options : {packages, missing})
    CHECK(notes(mjcf, options) ==
          std::vector<std::string>{"packages, and what stands for a missing mesh, say nothing for MJCF"});
  CHECK(notes(mjcf, root).empty());
}

TEST_CASE("joints that turn freely, mimic, float or rest off zero are what the file says") {
  const auto read = [](const std::string& text) {
    const TemporaryFile file("r.urdf", text);
    return scenes::import_robot(file.path(), {});
  };
  const scenes::Robot free = read(jointed("continuous", ""));
  CHECK(free.variables[0].upper == doctest::Approx(3.141592653589793));
  const scenes::Robot off = read(jointed("revolute", "<limit lower='1' upper='2' effort='1' velocity='1'/>"));
  CHECK(off.variables[0].rest == 1.5);
  const scenes::Robot wide = read(jointed("revolute", "<limit lower='-1e16' upper='1e16' effort='1' velocity='1'/>"));
  CHECK(wide.variables[0].lower == doctest::Approx(-3.141592653589793));
  CHECK(wide.notes.size() == 1);
  const scenes::Robot floating = read(jointed("floating", ""));
  CHECK(floating.variables.empty());
  CHECK(floating.links[1].floats);
  REQUIRE(floating.notes.size() == 1);
  CHECK(floating.notes[0] == "joint j is floating: held at its origin");
}

TEST_CASE("what a URDF file says of looks, masses and motors neither refuses the robot nor changes it") {
  const std::string limit = "<limit lower='-1' upper='1'", pose = "<origin xyz='.5 0 0' rpy='0 0 1'/>";
  const auto robot = [&](const std::string& in_link, const std::string& in_joint, const std::string& in_limit = "",
                         const std::string& in_robot = "") {
    return robot_of(in_robot + "<link name='a'>" + kBox + "</link><link name='b'>" + in_link + kBox +
                    "</link><joint name='j' type='revolute'><parent link='a'/><child link='b'/>" + pose + limit +
                    in_limit + "/>" + in_joint + "</joint>");
  };
  const TemporaryFile plain("r.urdf", robot("", ""));
  const scenes::Robot expected = scenes::import_robot(plain.path(), in_child());
  const std::string box = "<geometry><box size='1 1 1'/></geometry>";
  for (const std::string& text : std::vector<std::string>{
           robot("<visual/>", ""),
           robot("<visual><geometry/></visual>", ""),
           robot("<visual><geometry><capsule radius='1' length='1'/></geometry></visual>", ""),
           robot("<visual><geometry><cone/></geometry></visual>", ""),
           robot("<visual><geometry><mesh/></geometry></visual>", ""),
           robot("<visual><geometry><mesh filename='v.stl' scale='.1'/></geometry></visual>", ""),
           robot("<visual><origin xyz='a b'/>" + box + "</visual>", ""),
           robot("<visual>" + box + "<material><color rgba='1 0 0 1'/></material></visual>", ""),
           robot("<visual>" + box + "<material name=''><color rgba='1 0 x'/></material></visual>", ""),
           robot("<visual>" + box + "<material name='m'><texture/></material></visual>", ""),
           robot("<inertial/>", ""),
           robot("<inertial><mass value='1'/></inertial>", ""),
           robot("<inertial><mass value='x'/><inertia ixx='nan'/></inertial>", ""),
           robot("<contact><lateral_friction value='1'/></contact>", ""),
           robot("", "<dynamics/>"),
           robot("", "<dynamics damping='x'/>"),
           robot("", "<safety_controller/>"),
           robot("", "<calibration rising='x'/>"),
           robot("", "", " effort='x'"),
           robot("", "", " effort='1' velocity=''"),
           robot("", "", "", "<material/>"),
           robot("", "", "", "<material name='m'/><material name='m'/>"),
           robot("", "", "", "<transmission/><gazebo reference='b'><selfCollide/></gazebo><sensor/>"),
           replaced(robot("", ""), " name='r'", " name='r' version='1.2'"),
           replaced(robot("", ""), "xyz='.5 0 0'", "xyz=' .5\t0\n0 '"),
           replaced(robot("", ""), "<robot", "\xef\xbb\xbf<?xml version='1.0'?><!DOCTYPE robot><!-- --><robot")}) {
    CAPTURE(text);
    const TemporaryFile file("r.urdf", text);
    scenes::Robot read = scenes::import_robot(file.path(), in_child());
    read.leaf_sources = expected.leaf_sources;  // where they are written
    CHECK(same_robot(read, expected));
  }
  const TemporaryFile nameless("arm.urdf", replaced(robot("", ""), " name='r'", ""));
  CHECK(scenes::import_robot(nameless.path(), in_child()).body.name == "arm");
}

TEST_CASE("what a URDF file leaves open is guessed with a note, and what it only shows is told") {
  const auto read = [](const std::string& text) {
    const TemporaryFile file("r.urdf", text);
    return scenes::import_robot(file.path(), in_child());
  };
  const scenes::Robot still = read(jointed("revolute", "<limit effort='1' velocity='1'/>"));
  CHECK(still.variables[0].upper == 0);
  CHECK(still.left_out.guesses == 1);
  REQUIRE(still.notes.size() == 1);
  CHECK(still.notes[0].find("line 4: joint j has no lower and no upper limit") != std::string::npos);
  const scenes::Robot seen = read(robot_of(link_of("<sphere radius='1'/>") + "<link name='b'><visual/></link>" +
                                           "<joint name='j' type='fixed'><parent link='a'/><child link='b'/></joint>"
                                           "<drake:collision_filter_group name='g'/>"));
  REQUIRE(seen.notes.size() == 2);
  CHECK(seen.notes[0] == "links with a visual but no collision shape, which nothing tests: 1: b");
  CHECK(seen.notes[1].find(
            "not read, though about collisions: <drake:collision_filter_group> (1, the first in line 2)") !=
        std::string::npos);
}

TEST_CASE("a capsule of URDF has its length without the caps, and is a ball without length") {
  for (const std::string name : {"capsule", "drake:capsule"}) {
    const TemporaryFile file(
        "r.urdf",
        robot_of("<link name='a'>" + kBox + "<collision><origin xyz='1 2 3'/><geometry><" + name +
                 " radius='.1' length='.6'/></geometry></collision><collision><geometry><cylinder radius='.1' "
                 "length='.6'/></geometry></collision><collision><geometry><" +
                 name + " radius='.1' length='0'/></geometry></collision></link>"));
    const scenes::Robot robot = scenes::import_robot(file.path(), in_child());
    REQUIRE(robot.body.leaves.size() == 4);
    const ConvexPart& capsule = robot.body.leaves[1].parts[0].shape;
    CHECK(capsule.kind == ShapeKind::kCapsule);
    CHECK(capsule.size[0] == .1f);
    CHECK(capsule.size[1] == .3f);
    CHECK(capsule.position[2] == 3.f);
    CHECK(robot.body.leaves[2].parts[0].shape.kind == ShapeKind::kCylinder);
    CHECK(robot.body.leaves[3].parts[0].shape.kind == ShapeKind::kSphere);
    CHECK(robot.body.leaves[3].parts[0].shape.size[0] == .1f);
  }
}

TEST_CASE("shapes of size 0 are left out with a note, and the others of their link stay") {
  const TemporaryFile mesh("cube.obj", cube());
  const std::string file = "filename='" + mesh.path() + "'";
  for (const std::string& empty : std::vector<std::string>{
           "<sphere radius='0'/>", "<box size='0 .1 .1'/>", "<box size='0 0 0'/>", "<cylinder radius='.1' length='0'/>",
           "<cylinder radius='0' length='.1'/>", "<capsule radius='0' length='.1'/>", "<sphere radius='1e-60'/>",
           "<mesh " + file + " scale='0 0 0'/>", "<mesh " + file + " scale='1 1 -0'/>"}) {
    CAPTURE(empty);
    const std::string shape = "<collision><geometry>" + empty + "</geometry></collision>";
    const TemporaryFile robot_file("r.urdf", robot_of("<link name='a'>" + kBox + shape + kBox + "</link>"));
    const scenes::Robot robot = scenes::import_robot(robot_file.path(), in_child());
    CHECK(robot.body.leaves.size() == 2);
    CHECK(robot.left_out.shapes == 1);
    REQUIRE(robot.notes.size() == 1);
    CHECK(robot.notes[0].find("line 2: link a: collision 2") != std::string::npos);
    CHECK(robot.notes[0].find("left out, since a size of it is 0") != std::string::npos);
  }
  const TemporaryFile one("r.urdf", robot_of(link_of("<mesh " + file + " scale='.5'/>")));
  const scenes::Robot scaled = scenes::import_robot(one.path(), in_child());
  CHECK(greatest(scaled.body.leaves[0].parts[0].vertices) == std::array<double, 3>{.5, .5, .5});
  CHECK(scaled.left_out.guesses == 1);
}

TEST_CASE("packages are found by the name in package.xml, above, beside, and where ROS has them") {
  const TemporaryFile mesh("cube.obj", cube());
  const fs::path root = mesh.directory();
  const auto package = [&](const std::string& folder, const std::string& name) {
    fs::create_directories(root / folder / "meshes");
    fs::copy_file(mesh.path(), root / folder / "meshes/cube.obj");
    std::ofstream(root / folder / "package.xml") << "<package format='2'>\n<name> " << name << "\n</name></package>";
  };
  package("ws/checkout", "my_robot");
  package("ws/other_checkout", "other_robot");
  package("ros/stack/some", "in_ros");
  package("ros/by_name", "another_name");
  package("prefix/share/in_ament", "in_ament");
  std::ofstream(root / "ws/package.xml") << "<package><name>broken";
  fs::create_directories(root / "ws/checkout/urdf");
  const std::string path = (root / "ws/checkout/urdf/r.urdf").string();
  const auto refused = [&](const std::string& name) {
    std::ofstream(path) << robot_of(link_of("<mesh filename='package://" + name + "/meshes/cube.obj'/>"));
    std::string here, child;
    try {
      scenes::import_robot(path, {});
    } catch (const scenes::ImportError& error) { here = error.what(); }
    try {
      scenes::import_robot(path, in_child());
    } catch (const scenes::ImportError& error) { child = error.what(); }
    CHECK(here == child);
    return !here.empty();
  };
  CHECK_FALSE(refused("my_robot"));
  CHECK_FALSE(refused("other_robot"));
  for (const char* const name : {"in_ros", "by_name", "another_name", "in_ament"}) CHECK(refused(name));
  setenv("ROS_PACKAGE_PATH", (":" + (root / "lost").string() + ":" + (root / "ros").string()).c_str(), 1);
  setenv("AMENT_PREFIX_PATH", (root / "prefix").c_str(), 1);
  for (const char* const name : {"in_ros", "by_name", "another_name", "in_ament"}) CHECK_FALSE(refused(name));
  CHECK(refused("nowhere"));
  // What is given wins, though it has no such mesh.
  scenes::RobotOptions given = in_child();
  given.packages = {{"my_robot", (root / "ros").string()}};
  std::ofstream(path) << robot_of(link_of("<mesh filename='package://my_robot/meshes/cube.obj'/>"));
  CHECK_THROWS_WITH_AS(scenes::import_robot(path, given), doctest::Contains("no such file"), scenes::ImportError);
  unsetenv("ROS_PACKAGE_PATH");
  unsetenv("AMENT_PREFIX_PATH");
}

TEST_CASE("a refusal is at most 300 bytes, however many links have the same fault and whatever their names") {
  std::string links, joints;
  for (int l = 0; l < 60; ++l) {
    const std::string name = "a_link_with_quite_a_long_name_" + std::to_string(l);
    links += "<link name='" + name + "'><collision><geometry><sphere radius='x'/></geometry></collision></link>\n";
    if (l > 0)
      joints += "<joint name='j" + std::to_string(l) +
                "' type='fixed'><parent link='a_link_with_quite_a_long_name_0'/>" + "<child link='" + name +
                "'/></joint>\n";
  }
  const std::string endless(5000, 'n');
  for (const std::string& text :
       {robot_of(links + joints), robot_of("<link name='" + endless + "'><collision/></link>")}) {
    const TemporaryFile file("bad.urdf", text);
    try {
      scenes::import_robot(file.path(), in_child());
      FAIL("it is refused");
    } catch (const scenes::ImportError& error) { CHECK(std::string(error.what()).size() <= 290); }
  }
  CHECK(refusal(robot_of(links + joints)).size() < 400);  // without a child too
}

TEST_CASE("a bad URDF file gives one line with the line or element and the reason, and prints nothing else") {
  struct Bad {
    std::string text;
    std::string told;  // the beginning of the refusal, which ends with a colon at most
  };
  const std::string deep = [] {
    std::string text;
    for (int k = 0; k < 100000; ++k) text += "<a>";
    return text;
  }();
  std::string many;
  for (int k = 0; k < 1025; ++k) many += "<link name='l" + std::to_string(k) + "'/>\n";
  const std::vector<Bad> bad = {
      {"<robot name='r'>\n<link name='a'>\n</robot>", "line 2: not well-formed XML"},
      {"nothing", "line 1: not well-formed XML"},
      {deep, "line 1: not well-formed XML (XML_ELEMENT_DEPTH_EXCEEDED)"},
      {std::string("<robot name='r'>\0</robot>", 26), "a zero byte is not XML"},
      {"\n<html/>", "line 2: the first element is <html>, but URDF begins with <robot> and MJCF with <mujoco>"},
      {robot_of(""), "No link elements found"},
      {"<robot><link name='a'/></robot>", "no link has a collision shape"},
      {"<robot version='2.0'><link name='a'/></robot>", "line 1: version 2.0 of URDF is not read"},
      {robot_of("<link/>"), "line 2: a <link> without a name"},
      {robot_of("<link name=''/>"), "line 2: a <link> without a name"},
      {robot_of("<link name='a'/>\n<joint type='fixed'/>"), "line 3: a <joint> without a name"},
      {robot_of("<link name='a'/>\n<joint name='j' type='fixed'><child link='a'/></joint>"),
       "line 3: joint j: it has no parent or no child"},
      {robot_of("<link name='a'/>"), "no link has a collision shape"},
      {robot_of("<xacro:include filename='x'/>"), "line 2: <xacro:include> is of xacro"},
      {robot_of("<link name='a'>\n<xacro:box_collision/></link>"), "line 3: <xacro:box_collision> is of xacro"},
      {robot_of(many), "line 1026: more than 1024 links"},
      {robot_of("<link name='a'/>\n<link name='a'/>"), "line 2: link 'a' is not unique"},
      {robot_of("<link name='a'/>\n<link name='b'/>"), "line 2: "},
      {robot_of("<link name='a'/>\n<joint name='j' type='fixed'><parent link='a'/><child link='c'/></joint>"),
       "line 3: "},
      {robot_of("<link name='a'/>\n<joint name='j' type='fixed'><parent link='c'/><child link='a'/></joint>"),
       "line 3: "},
      {robot_of("<link name='a'/><link name='b'/><link name='c'/>\n"
                "<joint name='j' type='fixed'><parent link='a'/><child link='b'/></joint>\n"
                "<joint name='k' type='fixed'><parent link='c'/><child link='b'/></joint>"),
       "line 4: link b is the child of two joints, j and k"},
      {robot_of("<link name='a'/>\n<link name='b'/><link name='c'/>\n"
                "<joint name='j' type='fixed'><parent link='b'/><child link='c'/></joint>\n"
                "<joint name='k' type='fixed'><parent link='c'/><child link='b'/></joint>"),
       "line 5: joint k: link b is in or below a loop of joints"},
      {jointed("revolute", ""), "line 4: joint j: it is revolute and has no <limit>"},
      {jointed("prismatic", "<dynamics/>"), "line 4: joint j: it is prismatic and has no <limit>"},
      {jointed("fixed", "<origin quat_xyzw='0 0 0 1'/>"), "line 4: an origin with quat_xyzw"},
      {jointed("revolute", "<limit lower='${-pi}' upper='1'/>"), "line 4: "},
      {jointed("continuous", "<mimic/>"), "line 4: "},
      {jointed("wheel", ""), "line 4: "},
      {jointed("continuous", "<axis xyz='0 0 0'/>"), "line 4: joint j: its axis has no direction"},
      {jointed("continuous", "<axis xyz='0 one 0'/>"), "line 4: "},
      {jointed("revolute", "<limit lower='2' upper='1' effort='1' velocity='1'/>"),
       "line 4: joint j: its lower limit is above its upper limit"},
      {jointed("prismatic", "<limit lower='-1e16' upper='1' effort='1' velocity='1'/>"),
       "line 4: joint j: its limits are beyond 1e9 m"},
      {jointed("continuous", "<mimic joint='j'/>"), "line 4: joint j: it mimics a joint that mimics it"},
      {jointed("continuous", "<mimic joint='k'/>"), "line 4: joint j: it mimics k, which is no joint that moves"},
      {jointed("continuous", "<origin xyz='1e30 0 0'/>"), "line 4: joint j: its origin"},
      {robot_of("<link name='a'/><link name='b'/><link name='c'/>\n"
                "<joint name='i' type='continuous'><parent link='a'/><child link='b'/></joint>\n"
                "<joint name='j' type='continuous'><parent link='b'/><child link='c'/>"
                "<mimic joint='i' multiplier='1e10'/></joint>"),
       "line 4: joint j: its mimic has a multiplier or offset that is not a number or beyond 1e9"},
      {robot_of(link_of("<box size='0 1 1'/>")), "no link has a collision shape"},
      {robot_of(link_of("<box size='1 -0.1 1'/>")), "line 2: link a: collision 1: its size must be from 0 to 1e9 m"},
      {robot_of(link_of("<sphere radius='-1'/>")), "line 2: link a: collision 1: its size must be from 0 to 1e9 m"},
      {robot_of(link_of("<sphere radius='nan'/>")), "line 2: link a: "},
      {robot_of(link_of("<capsule radius='1e10' length='1'/>")), "line 2: link a: collision 1: its size must be"},
      {robot_of(link_of("<cylinder radius='1'/>")), "line 2: link a: urdfdom reads 0 of its 1 collision shapes: "},
      {robot_of(link_of("<cone radius='1'/>")),
       "line 2: link a: collision 1: <cone> is none of box, sphere, cylinder, capsule and mesh"},
      {robot_of(link_of("")), "line 2: link a: collision 1: it has no shape"},
      {robot_of("<link name='a'>\n<collision/></link>"), "line 3: link a: collision 1: it has no shape"},
      {robot_of(link_of("<sphere radius='1'/><sphere radius='2'/>")),
       "line 2: link a: collision 1: it has more than one"},
      {robot_of(link_of("<mesh/>")), "line 2: link a: urdfdom reads 0 of its 1 collision shapes: "},
      {robot_of(link_of("<mesh filename='http://x/y.stl'/>")),
       "line 2: link a: collision 1: mesh http://x/y.stl: only package://"},
      {robot_of(link_of("<mesh filename='bad.urdf'/>")),
       "line 2: link a: collision 1: mesh bad.urdf: meshes are read from .stl"},
  };
  for (const Bad& one : bad) {
    CAPTURE(one.text.substr(0, 300));
    std::string told;
    CHECK(printed_by([&] { told = refusal(one.text); }) == "");
    CAPTURE(told);
    CHECK(refusal(one.text, in_child()).substr(0, one.told.size()) == told.substr(0, one.told.size()));
    CHECK(told.rfind(one.told, 0) == 0);
    CHECK(told.size() > one.told.size() - 1);
  }
}

TEST_CASE("mesh files that are no meshes are refused by name, in a child process with the same words") {
  const TemporaryFile folder("a.urdf", "x");
  const auto answer = [&](const scenes::RobotOptions& options) {
    try {
      scenes::import_robot(folder.path(), options);
    } catch (const scenes::ImportError& error) { return std::string(error.what()).substr(folder.path().size() + 2); }
    return std::string("read");
  };
  const auto refused = [&](const std::string& name, const std::string& bytes) {
    std::ofstream((folder.directory() / name).string(), std::ios::binary) << bytes;
    std::ofstream(folder.path()) << robot_of(link_of("<mesh filename='" + name + "'/>"));
    const std::string told = answer({});
    CHECK(answer(in_child()) == told);
    return told;
  };
  CHECK(refused("good.obj", cube()) == "read");
  CHECK(refused("a.stl", "no triangles here").find("mesh a.stl: ") != std::string::npos);
  CHECK(refused("empty.obj", "").find("mesh empty.obj: the file is empty") != std::string::npos);
  CHECK(refused("nan.obj", "v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").find("mesh nan.obj: ") != std::string::npos);
}

TEST_CASE("a robot whose reader crashes, fills memory or does not end costs one line that names the file") {
  std::string nodes;
  for (int k = 0; k < 20000; ++k) nodes += "<node>";
  for (int k = 0; k < 20000; ++k) nodes += "</node>";
  // assimp 5.2.5 ends in a segmentation fault, by recursion.
  const TemporaryFile mesh(
      "deep.dae",
      R"(<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" )"
      R"(version="1.4.1"><asset><up_axis>Y_UP</up_axis></asset><library_visual_scenes><visual_scene id="s">)" +
          nodes +
          R"(</visual_scene></library_visual_scenes><scene><instance_visual_scene url="#s"/></scene>)"
          "</COLLADA>");
  const std::string told = refusal(robot_of(link_of("<mesh filename='" + mesh.path() + "'/>")), in_child());
  const std::string in_mesh = ", in " + mesh.path();
  CAPTURE(told);
  CHECK(told.rfind("reading it ", 0) == 0);
  REQUIRE(told.size() > in_mesh.size());
  CHECK(told.substr(told.size() - in_mesh.size()) == in_mesh);

  scenes::RobotOptions no_time = in_child();
  no_time.sandbox->wall_seconds = 0;
  CHECK(refusal(robot_of(link_of("<sphere radius='1'/>")), no_time) == "reading it took more than 0 s");
  if (!scenes::reads_mjcf()) {
    MESSAGE("skipped: libmujoco is not built in");
    return;
  }
  scenes::RobotOptions little = in_child();
  little.sandbox->memory_bytes = std::size_t{64} << 20;
  little.sandbox->cpu_seconds = 1;
  CHECK(refusal("<mujoco><worldbody><body name='b'><composite type='grid' count='300 300 1' spacing='.1'>"
                "<geom size='.01'/></composite></body></worldbody></mujoco>",
                little)
            .find("reading it ") == 0);
  if (!scenes::sandbox_limits_memory()) {
    MESSAGE("skipped: memory is not limited under AddressSanitizer and ThreadSanitizer");
    return;
  }
  // Elements of about 120 bytes. What the allocator has kept free of earlier tests (140 MB) is mapped already, so the
  // child may use that too.
  std::string many;
  for (int k = 0; k < 4000000; ++k) many += "<a/>";
  CHECK(refusal("<mujoco><visual>" + many + "</visual></mujoco>", little) ==
        "reading it needs more than 64 MiB of memory");
}

TEST_CASE("in a child process, MJCF has the meshes near its folder, of its package and below --root, and no others") {
  if (!scenes::reads_mjcf() || !scenes::sandbox_limits_files()) {
    MESSAGE("skipped: libmujoco is not built in, or this kernel has no Landlock");
    return;
  }
  const TemporaryFile top("cube.obj", cube());
  const fs::path folder = top.directory() / "a/b/mjcf";
  fs::create_directories(folder / "below");
  fs::create_directories(folder / "../meshes");
  for (const char* copy : {"below/cube.obj", "../meshes/cube.obj", "../../cube.obj"})
    fs::copy_file(top.path(), folder / copy);
  const auto read = [&](const std::string& settings, const std::string& mesh, const scenes::RobotOptions& options) {
    const std::string path = (folder / "r.xml").string();
    std::ofstream(path) << "<mujoco>" << settings << "<asset><mesh name='m' file='" << mesh
                        << "'/></asset><worldbody><geom type='mesh' mesh='m'/></worldbody></mujoco>";
    try {
      return std::to_string(scenes::import_robot(path, options).body.leaves.size());
    } catch (const scenes::ImportError& error) { return std::string(error.what()).substr(path.size() + 2); }
  };
  CHECK(read("", "below/cube.obj", in_child()) == "1");
  CHECK(read("<compiler meshdir='../meshes'/>", "cube.obj", in_child()) == "1");
  CHECK(read("<compiler assetdir='../meshes/'/>", "cube.obj", in_child()) == "1");
  CHECK(read("<compiler assetdir='no' meshdir='../meshes'/>", "cube.obj", in_child()) == "1");
  CHECK(read("<compiler meshdir='below' strippath='true'/>", "../../../cube.obj", in_child()) == "1");
  CHECK(read("", "../../cube.obj", in_child()) == "1");
  CHECK(read("", top.path(), {}) == "1");
  // Three folders above it is too far, but for --root or a package.
  const std::string told = read("", "../../../cube.obj", in_child());
  CHECK(told.find("line 1: mesh ../../../cube.obj: " + top.path() + " is there, but ") == 0);
  CHECK(told.find("--root DIR") != std::string::npos);
  CHECK(read("", top.path(), in_child()).find("--root DIR") != std::string::npos);
  scenes::RobotOptions rooted = in_child();
  rooted.root = top.directory().string();
  CHECK(read("", "../../../cube.obj", rooted) == "1");
  std::ofstream((folder / "near.xml").string()) << "<m><include file='../../../far.xml'/></m>";
  std::ofstream((top.directory() / "far.xml").string()) << "<m><geom size='1'/><include file='a/b/last.xml'/></m>";
  std::ofstream((top.directory() / "a/b/last.xml").string()) << "<m><geom size='1'/></m>";
  CHECK(read("<worldbody><include file='near.xml'/></worldbody>", "below/cube.obj", rooted) == "3");
  CHECK(read("<worldbody><include file='near.xml'/></worldbody>", "below/cube.obj", in_child()).find("--root DIR") !=
        std::string::npos);
  std::ofstream((top.directory() / "a/package.xml").string()) << "<package/>";
  CHECK(read("", "../../../cube.obj", in_child()).find("--root DIR") != std::string::npos);
  std::ofstream((top.directory() / "package.xml").string()) << "<package/>";
  fs::remove(top.directory() / "a/package.xml");
  CHECK(read("", "../../../cube.obj", in_child()) == "1");
}

TEST_CASE("SRDF: disabled pairs are read once each, unknown links are told") {
  const TemporaryFile file("r.urdf", jointed("continuous", ""));
  const scenes::Robot robot = scenes::import_robot(file.path(), {});
  const TemporaryFile srdf("r.srdf", robot_of("<disable_collisions link1='b' link2='a' reason='Adjacent'/>\n"
                                              "<disable_collisions link1='a' link2='b' reason='Never'/>\n"
                                              "<disable_collisions link1='a' link2='a'/>\n"
                                              "<disable_collisions link1='a' link2='hand' reason='Never'/>"));
  for (const std::optional<scenes::SandboxLimits>& sandbox : {std::optional(scenes::kImportSandbox), {}}) {
    const scenes::DisabledPairs disabled = scenes::read_disabled_pairs(srdf.path(), robot, sandbox);
    REQUIRE(disabled.pairs.size() == 1);
    CHECK(disabled.pairs[0].a == 0);
    CHECK(disabled.pairs[0].b == 1);
    REQUIRE(disabled.notes.size() == 1);
    CHECK(disabled.notes[0] == srdf.path() + ": the robot has no link hand");
  }
  const TemporaryFile half("h.srdf", robot_of("<disable_collisions link1='b'/>"));
  CHECK_THROWS_WITH_AS(scenes::read_disabled_pairs(half.path(), robot, {}),
                       doctest::Contains("line 2: <disable_collisions> without link2"), scenes::ImportError);
  const TemporaryFile other("o.srdf", "<srdf/>");
  CHECK_THROWS_WITH_AS(scenes::read_disabled_pairs(other.path(), robot, {}),
                       doctest::Contains("line 1: the first element is <srdf>"), scenes::ImportError);
}

TEST_CASE("SRDF: a link's collisions are off by default but for those that are on again, and what is unread is told") {
  const TemporaryFile file("r.urdf",
                           robot_of("<link name='a'>" + kBox +
                                    "</link><link name='b'/><link name='c'/>"
                                    "<joint name='j' type='fixed'><parent link='a'/><child link='b'/></joint>"
                                    "<joint name='k' type='fixed'><parent link='b'/><child link='c'/></joint>"));
  const scenes::Robot robot = scenes::import_robot(file.path(), {});
  const auto read = [&](const std::string& inside) {
    const TemporaryFile srdf("r.srdf", "\xef\xbb\xbf" + robot_of(inside));
    return scenes::read_disabled_pairs(srdf.path(), robot, scenes::kImportSandbox);
  };
  const auto pairs = [&](const std::string& inside) {
    std::string text;
    for (const LinkPair& pair : read(inside).pairs)
      text += robot.body.link_names[pair.a] + robot.body.link_names[pair.b] + " ";
    return text;
  };
  const std::string off = "<disable_default_collisions link=' a '/>";
  CHECK(pairs(off) == "ab ac ");
  CHECK(pairs(off + "<enable_collisions link1='b' link2='a'/>") == "ac ");
  CHECK(pairs("<enable_collisions link1='a' link2='b'/>" + off + off) == "ac ");
  // A pair that is disabled by name stays so.
  CHECK(pairs(off + "<enable_collisions link1='a' link2='b'/><disable_collisions link1='a' link2='b'/>") == "ab ac ");
  CHECK(pairs("<enable_collisions link1='a' link2='b'/>") == "");
  CHECK(pairs("<disable_default_collisions link='hand'/>") == "");
  CHECK(read("<disable_default_collisions link='hand'/><disable_collisions link1='a' link2='foot'/>")
            .notes[0]
            .find("the robot has no links foot, hand") != std::string::npos);
  CHECK(read(off + "<group name='g'><link name='a'/></group><virtual_joint/>").notes.empty());
  const std::vector<std::string> unread =
      read("<collision_default link='a'/>\n<group><disable_collisions link1='a' link2='b'/></group>").notes;
  REQUIRE(unread.size() == 1);
  CHECK(unread[0].find("not read, though about collisions: <collision_default> (1, the first in line 2), "
                       "<disable_collisions> (1, the first in line 3)") != std::string::npos);
  CHECK_THROWS_WITH_AS(read("<xacro:panda/>"), doctest::Contains("line 2: <xacro:panda> is of xacro"),
                       scenes::ImportError);
  CHECK_THROWS_WITH_AS(read("<disable_default_collisions/>"),
                       doctest::Contains("line 2: <disable_default_collisions> without link"), scenes::ImportError);
}

TEST_CASE("SRDF: another robot's name is told, and no note is long") {
  const TemporaryFile file("r.urdf", jointed("continuous", ""));
  const scenes::Robot robot = scenes::import_robot(file.path(), {});
  const auto notes = [&](const std::string& text) {
    const TemporaryFile srdf("r.srdf", text);
    std::vector<std::string> read = scenes::read_disabled_pairs(srdf.path(), robot, scenes::kImportSandbox).notes;
    CHECK(read == scenes::read_disabled_pairs(srdf.path(), robot, {}).notes);
    for (const std::string& note : read) CHECK(note.size() <= 280);
    return read;
  };
  const std::string pair = "<disable_collisions link1='a' link2='b'/>", name(5000, 'n');
  CHECK(notes("<robot name='r'>" + pair + "</robot>").empty());
  CHECK(notes("<robot>" + pair + "</robot>").empty());
  const std::vector<std::string> other = notes("<robot name='panda'>" + pair + "</robot>");
  REQUIRE(other.size() == 1);
  CHECK(other[0].find("r.srdf: it is for the robot panda, and this one is r") != std::string::npos);
  const std::vector<std::string> many = notes("<robot name='" + name + "'><disable_collisions link1='a' link2='" +
                                              name + "'/><" + name + "_collision/></robot>");
  REQUIRE(many.size() == 3);
  CHECK(many[0].find("it is for the robot nnn") != std::string::npos);
  CHECK(many[1].find("the robot has no link nnn") != std::string::npos);
  CHECK(many[2].find("not read, though about collisions: <nnn") != std::string::npos);
}

TEST_CASE("URDF: what is misspelt in a link is told") {
  const auto notes = [](const std::string& inside) {
    const TemporaryFile file("r.urdf", robot_of(inside));
    std::vector<std::string> read = scenes::import_robot(file.path(), in_child()).notes;
    for (const std::string& note : read) CHECK(note.size() <= 280);
    return read;
  };
  const std::string link = "<link name='a'>" + kBox, shape = "<geometry><sphere radius='1'/></geometry>";
  CHECK(
      notes(link + "<visual>" + shape + "</visual><inertial/><contact/></link><gazebo/><material name='m'/>").empty());
  const std::vector<std::string> told =
      notes(link + "\n<Collision>" + shape + "</Collision>\n<collisions/><Collision/></link><Link name='b'/>");
  REQUIRE(told.size() == 1);
  CHECK(told[0].find("r.urdf: not known to URDF, and not read: <Collision> (2, the first in line 3), <Link> (1, the "
                     "first in line 4), <collisions> (1, the first in line 4)") != std::string::npos);
  // A joint's own words count by their case alone, as do those of a shape.
  CHECK(notes("<link name='a'><collision><Origin xyz='1 0 0'/><name/>" + shape + "</collision></link>")[0].find(
            "not read: <Origin> (1, the first in line 2)") != std::string::npos);
  CHECK(notes(link + "</link><link name='b'/><joint name='j' type='fixed'><parent link='a'/><child link='b'/>"
                     "<Origin xyz='1 0 0'/><dynamics/></joint>")[0]
            .find("not read: <Origin> (1, the first in line 2)") != std::string::npos);
  CHECK(notes(link + "<" + std::string(5000, 'n') + "_collision/></link>").size() == 1);
}

TEST_CASE("MJCF: shapes, excluded bodies and contact bits are as the file says") {
  const std::string text = R"(<mujoco model="made"><worldbody>
    <geom type="plane" size="1 1 1"/>
    <body name="a"><freejoint/><geom type="box" size="1 2 3"/><geom type="sphere" size="1" contype="0" conaffinity="0"/>
      <body name="b"><joint name="slide" type="slide" axis="0 0 1" limited="false"/>
        <geom type="capsule" fromto="0 0 0 0 0 4" size=".5"/></body>
      <body name="c"><geom type="ellipsoid" size="1 2 3" contype="2" conaffinity="2"/></body>
    </body></worldbody><contact><exclude body1="a" body2="b"/></contact></mujoco>)";
  if (!scenes::reads_mjcf()) {
    CHECK(refusal(text).find("MJCF is not built in") == 0);
    MESSAGE("skipped: libmujoco is not built in");
    return;
  }
  const TemporaryFile file("r.xml", text);
  const scenes::Robot robot = scenes::import_robot(file.path(), {});
  CHECK(robot.body.name == "made");
  REQUIRE(robot.body.leaves.size() == 3);
  CHECK(robot.body.leaves[0].parts[0].shape.size[2] == 3.f);
  CHECK(robot.body.leaves[1].parts[0].shape.kind == ShapeKind::kCapsule);
  CHECK(robot.body.leaves[1].parts[0].shape.size[0] == .5f);
  CHECK(robot.body.leaves[1].parts[0].shape.size[1] == 2.f);
  CHECK(robot.body.leaves[1].parts[0].shape.position[2] == 2.f);
  CHECK(robot.body.leaves[2].parts[0].shape.kind == ShapeKind::kEllipsoid);
  CHECK(robot.links[1].floats);
  CHECK(robot.variables.empty());
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
  for (const LinkPair& pair : robot.body.ignored_pairs) pairs.emplace_back(pair.a, pair.b);
  std::sort(pairs.begin(), pairs.end());
  CHECK((pairs == std::vector<std::pair<std::uint32_t, std::uint32_t>>{{1, 2}, {1, 3}, {2, 3}}));
  CHECK(robot.notes == std::vector<std::string>{"not read, since it says nothing of shapes, joints and masks: <geom> "
                                                "without contact bits 1",
                                                "joint slide slides without limits: held where it is",
                                                "planes and height fields are left out: 1"});
  CHECK(refusal("<mujoco><worldbody><body><geom type='box'/></body></worldbody></mujoco>")
            .find("line 1: libmujoco cannot read") == 0);
  CHECK(refusal(
            "<mujoco><worldbody><body><joint name='j' axis='inf 0 0'/><geom size='1'/></body></worldbody></mujoco>") ==
        "joint j: it has a number that is none or out of range");
  CHECK(refusal("<mujoco><worldbody><body name='b' pos='1e30 0 0'><geom size='1'/></body></worldbody></mujoco>") ==
        "body b: its place is not a number or out of range");
  const std::string lost = refusal(
      "<mujoco><asset><mesh name='m' file='lost.stl'/></asset><worldbody><geom type='mesh' "
      "mesh='m'/></worldbody></mujoco>");
  CHECK(lost.find("lost.stl") != std::string::npos);
  CHECK(lost.find('?') == std::string::npos);
}

TEST_CASE("every robot file of the data is read") {
  const char* data = std::getenv("CAB_DATA_DIR");
  if (data == nullptr) {
    MESSAGE("skipped: CAB_DATA_DIR is not set");
    return;
  }
  struct File {
    const char* path;
    std::size_t links, leaves, variables;
  };
  const fs::path robots = fs::path(data) / "robots";
  for (const File& file : std::vector<File>{{"allegro_hand/allegro_hand_right.urdf", 23, 23, 16},
                                            {"panda_description/urdf/panda.urdf", 13, 17, 8},
                                            {"panda_description/urdf/panda_collision.urdf", 13, 39, 8},
                                            {"ur_description/urdf/ur5_robot.urdf", 11, 8, 6},
                                            {"mujoco_humanoid.xml", 17, 19, 21},
                                            {"mujoco_22_humanoids.xml", 353, 418, 462}}) {
    CAPTURE(std::string(file.path));
    if (fs::path(file.path).extension() == ".xml" && !scenes::reads_mjcf()) {
      MESSAGE("skipped: libmujoco is not built in");
      continue;
    }
    scenes::RobotOptions options;
    options.packages = {{"example-robot-data", data}};
    const scenes::Robot robot = scenes::import_robot((robots / file.path).string(), options);
    CHECK(same_robot(robot, scenes::import_robot((robots / file.path).string(), in_child(options))));
    CHECK(robot.links.size() == file.links);
    CHECK(robot.body.leaves.size() == file.leaves);
    CHECK(robot.variables.size() == file.variables);
  }
}

TEST_CASE("a robot file cut at twenty places or with bytes changed is read or refused in one line") {
  const std::string text = jointed("revolute",
                                   "<origin xyz='1 2 3' rpy='.1 .2 .3'/><axis xyz='0 1 0'/><limit lower='-1' "
                                   "upper='1' effort='1' velocity='1'/>");
  for (std::size_t k = 1; k < 20; ++k) {
    CAPTURE(k);
    CHECK(!refusal(text.substr(0, text.size() * k / 20)).empty());
  }
  scenes::Random random(5);
  int refused = 0;
  for (int round = 0; round < 200; ++round) {
    std::string changed = text;
    for (int byte = 0; byte < 5; ++byte)
      changed[random.index(static_cast<std::uint32_t>(text.size()))] = static_cast<char>(random.index(256));
    refused += !refusal(changed).empty();
  }
  CHECK(refused > 100);
}

}  // namespace cab::tests
