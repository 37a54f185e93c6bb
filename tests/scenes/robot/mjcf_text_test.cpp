// MJCF files of any version: what says nothing of shapes, joints and masks is passed over, what is newer than libmujoco
// is read as MuJoCo reads it or refused by name, and masks are MuJoCo's.
#include "scenes/robot/mjcf_text.h"

#include "scenes/import/limits.h"
#include "scenes/robot/kinematics.h"
#include "tests/scenes/temporary_file.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

namespace cab::tests {
namespace {

using Pairs = std::vector<std::pair<std::string, std::string>>;

std::string mujoco(const std::string& inside) { return "<mujoco>\n" + inside + "\n</mujoco>\n"; }
std::string world(const std::string& inside) { return mujoco("<worldbody>\n" + inside + "\n</worldbody>"); }
const std::string kBall = "<geom size='.1'/>";

scenes::Robot read(const std::string& text, const scenes::RobotOptions& options = {}) {
  const TemporaryFile file("r.xml", text);
  return scenes::import_robot(file.path(), options);
}

// The one line of a refusal after the file's path; empty if the text is read. The text alone needs no libmujoco.
std::string refusal(const std::string& text, const scenes::RobotOptions& options = {}) {
  const TemporaryFile file("r.xml", text);
  try {
    if (scenes::reads_mjcf()) {
      scenes::import_robot(file.path(), options);
    } else {
      scenes::mjcf_text(scenes::XmlText(file.path()), options);
    }
  } catch (const scenes::ImportError& error) {
    const std::string what = error.what();
    CHECK(what.size() <= 300);
    CHECK(what.find('\n') == std::string::npos);
    REQUIRE(what.rfind(file.path() + ": ", 0) == 0);
    return what.substr(file.path().size() + 2);
  }
  return {};
}

scenes::RobotOptions ignoring(const std::string& word) {
  scenes::RobotOptions options;
  options.ignored_words = {word};
  return options;
}

bool has_note(const scenes::Robot& robot, const std::string& part) {
  return std::any_of(robot.notes.begin(), robot.notes.end(),
                     [&](const std::string& note) { return note.find(part) != std::string::npos; });
}

Pairs named(const scenes::Robot& robot, const std::vector<LinkPair>& pairs) {
  Pairs names;
  for (const LinkPair& pair : pairs) names.emplace_back(robot.body.link_names[pair.a], robot.body.link_names[pair.b]);
  std::sort(names.begin(), names.end());
  return names;
}

using scenes::operator+;

// The centres of all shapes at rest, in the robot's frame.
std::vector<scenes::Vec3> centres(const scenes::Robot& robot) {
  std::vector<float> poses(7 * robot.links.size());
  scenes::Kinematics(robot).write_poses(scenes::rest_state(robot), poses);
  std::vector<scenes::Vec3> found;
  for (const scenes::BodyLeaf& leaf : robot.body.leaves) {
    const float* const p = leaf.parts[0].shape.position;
    const float* const pose = poses.data() + 7 * leaf.link;
    const scenes::Vec3 at = {pose[4], pose[5], pose[6]};
    found.push_back(at + scenes::rotate({pose[0], pose[1], pose[2], pose[3]}, {p[0], p[1], p[2]}));
  }
  return found;
}

void check_near(const scenes::Vec3& found, const scenes::Vec3& right) {
  for (std::size_t k = 0; k < 3; ++k) CHECK(std::fabs(found[k] - right[k]) < 1e-6);
}

bool skips() {
  if (!scenes::reads_mjcf()) MESSAGE("skipped: libmujoco is not built in");
  return !scenes::reads_mjcf();
}

}  // namespace

TEST_CASE("MJCF newer than libmujoco: a range alone limits a joint, and words about other things are counted") {
  if (skips()) return;
  const std::string bodies =
      "<worldbody><body name='base' gravcomp='1'><geom type='box' size='.05 .05 .05'/><body pos='0 0 .15'>"
      "<joint name='j' axis='0 1 0' range='-2 2' actuatorfrcrange='-50 50'/><geom size='.1' adhesion='1'/></body>"
      "</body></worldbody>";
  const std::string others =
      "<option><flag nativeccd='enable' later='disable'/></option><visual><global later='1'/></visual>"
      "<actuator><position joint='j' kp='1' kv='1'/></actuator><sensor><jointactuatorfrc joint='j'/><later/></sensor>"
      "<equality><later/></equality><keyframe><key qpos='0'/></keyframe><laser><beam/></laser>"
      "<extension><plugin plugin='p'/></extension>";
  const scenes::Robot robot = read(mujoco("<compiler angle='radian'/>" + others + bodies));
  REQUIRE(robot.variables.size() == 1);
  CHECK(robot.variables[0].lower == -2);
  CHECK(robot.variables[0].upper == 2);
  for (const char* part : {"<actuator> 1", "<sensor> 2", "<keyframe> 1", "actuatorfrcrange 1", "gravcomp 1",
                           "adhesion 1", "not about bodies: <laser> 1", "1 joints are limited by their range alone",
                           "equality constraints are not applied: 1"}) {
    CAPTURE(std::string(part));
    CHECK(has_note(robot, part));
  }
  CHECK_FALSE(has_note(robot, "<equality>"));  // which may hold joints
  // A file that says so itself has it its way.
  CHECK(refusal(mujoco("<compiler autolimits='false'/>" + bodies)).find("limited") != std::string::npos);
  const scenes::Robot free = read(world("<body>" + kBall + "<joint range='-90 90' limited='false'/></body>"));
  CHECK(free.variables[0].upper == doctest::Approx(3.141592653589793));
}

TEST_CASE("a note about words that are not read has at most 300 characters, however many they are") {
  if (skips()) return;
  std::string sections, attributes;
  scenes::RobotOptions options;
  for (int k = 100; k < 160; ++k) {
    const std::string number = std::to_string(k);
    sections += "<section" + number + "/>";
    options.ignored_words.push_back("a_word_that_is_ignored_" + number);
  }
  for (const char* word :
       {"adhesion", "condim", "density", "fluidcoef", "fluidshape", "friction", "gap", "group", "margin", "mass",
        "material", "priority", "rgba", "shellinertia", "solimp", "solmix", "solref", "surfacevel", "user"})
    attributes += std::string(" ") + word + "='1'";
  const std::string bodies = "<worldbody><geom size='.1'" + attributes + "/></worldbody>";
  const scenes::Robot robot = read(mujoco(sections + bodies), options);
  for (const std::string& note : robot.notes) CHECK(note.size() <= 300);
  CHECK(has_note(robot, "masks: adhesion 1, "));
  CHECK(has_note(robot, ", user 1"));
  CHECK(has_note(robot, "not about bodies: <section100> 1, "));
  CHECK(has_note(robot, " <section159> 1"));
  CHECK(has_note(robot, " a_word_that_is_ignored_159 0"));
}

TEST_CASE("MJCF: a bound of the vertices of hulls is told, as it is not applied") {
  if (skips()) return;
  const auto made = [](const std::string& attribute) {
    return read(
        mujoco("<default><equality solref='1 1'/></default><asset><mesh name='m' " + attribute +
               " vertex='0 0 0 1 0 0 0 1 0 0 0 1'/></asset><worldbody><geom type='mesh' mesh='m'/></worldbody>"));
  };
  CHECK(has_note(made("maxhullvert='8'"), "maxhullvert is not applied, meshes have their whole hulls: 1"));
  for (const char* attribute : {"maxhullvert='8'", "maxhullvert='-1'", ""})
    CHECK_FALSE(has_note(made(attribute), "says nothing of shapes"));
  CHECK_FALSE(has_note(made("maxhullvert='-1'"), "maxhullvert"));
}

TEST_CASE("a word that is not known where it may change the robot is refused by name, and --ignore passes it over") {
  const std::string body = "<body name='b'>" + kBall;
  struct Unknown {
    std::string text;  // with the word `later`
    std::string told;
  };
  const std::vector<Unknown> words = {
      {world("<body later='1'>" + kBall + "</body>"), "line 3: <body> has the attribute later"},
      {world("<body><geom size='.1' later='1'/></body>"), "line 3: <geom> has the attribute later"},
      {world(body + "<joint later='1'/></body>"), "line 3: <joint> has the attribute later"},
      {world(body + "<freejoint later='1'/></body>"), "line 3: <freejoint> has the attribute later"},
      {world(body + "<site later='1'/></body>"), "line 3: <site> has the attribute later"},
      {world(body + "<inertial pos='0 0 0' mass='1' later='1'/></body>"), "line 3: <inertial> has the attribute later"},
      {world("<frame later='1'>" + kBall + "</frame>"), "line 3: <frame> has the attribute later"},
      {world("<replicate count='2' later='1'>" + kBall + "</replicate>"),
       "line 3: <replicate> has the attribute later"},
      {world(body + "<later/></body>"), "line 3: <later> in <body>"},
      {world(kBall + "<later/>"), "line 3: <later> in <worldbody>"},
      {mujoco("<contact><exclude body1='world' body2='b' later='1'/></contact><worldbody>" + body +
              "</body></worldbody>"),
       "line 2: <exclude> has the attribute later"},
      {mujoco("<contact><later/></contact><worldbody>" + kBall + "</worldbody>"), "line 2: <later> in <contact>"},
      {mujoco("<default><geom later='1'/></default><worldbody>" + kBall + "</worldbody>"),
       "line 2: <geom> has the attribute later"},
      {mujoco("<default><later/></default><worldbody>" + kBall + "</worldbody>"), "line 2: <later> in <default>"},
      {mujoco("<compiler later='1'/><worldbody>" + kBall + "</worldbody>"),
       "line 2: <compiler> has the attribute later"},
      {"<mujoco later='1'><worldbody>" + kBall + "</worldbody></mujoco>", "line 1: <mujoco> has the attribute later"},
  };
  for (const Unknown& word : words) {
    CAPTURE(word.text);
    const std::string told = refusal(word.text);
    CAPTURE(told);
    CHECK(told.rfind(word.told + ", which no MuJoCo up to 3.12.0 has", 0) == 0);
    CHECK(told.find("; --ignore later passes it over") != std::string::npos);
    CHECK(refusal(word.text, ignoring("other")) == told);
    CHECK(refusal(word.text, ignoring("later")).empty());
    if (scenes::reads_mjcf()) CHECK(has_note(read(word.text, ignoring("later")), "passed over by --ignore: later 1"));
  }
  if (scenes::reads_mjcf()) CHECK(has_note(read(world(kBall), ignoring("late")), "passed over by --ignore: late 0"));
}

TEST_CASE("words of newer MuJoCo that make shapes and are not read are refused by name") {
  const std::string attach = "<asset><model name='m' file='m.xml'/></asset>";
  for (const auto& [text, told] : std::vector<std::pair<std::string, std::string>>{
           {world("<flexcomp name='f' type='grid'/>" + kBall), "line 3: <flexcomp> in <worldbody> is not read; "},
           {world(kBall + "<body><attach model='m' prefix='p'/></body>"), "line 3: <attach> in <body> is not read; "},
           {mujoco("<deformable><flex name='f'/></deformable><worldbody>" + kBall + "</worldbody>"),
            "line 2: <flex> in <deformable> is not read; "},
           {world("<body>" + kBall + "<composite type='cable' curve='l' count='9 1 1'/></body>"),
            "line 3: <composite> has the attribute curve, which is not read; "},
           {world("<body>" + kBall + "<frame><joint/></frame></body>"), "line 3: <joint> in <frame> is not read; "},
           {mujoco("<asset><mesh name='m' builtin='sphere' params='1'/></asset><worldbody><geom type='mesh' "
                   "mesh='m'/></worldbody>"),
            "line 2: <mesh> has the attribute builtin, which is not read; "},
           {world("<geom type='sdf' mesh='m'><plugin instance='i'/></geom>"),
            "line 3: <plugin> in <geom> is not read; "},
           {world("<geom type='sdf' mesh='m'/>"), "line 3: a geom of type sdf"}}) {
    const std::string refused = text;  // clang captures no structured binding
    CAPTURE(refused);
    CHECK(refusal(text).rfind(told, 0) == 0);
  }
}

TEST_CASE("what libmujoco refuses is told with the line of the file, in at most 300 characters") {
  if (skips()) return;
  CHECK(refusal(world("<body name='b'>\n<geom type='box' size='0 1 1'/></body>"))
            .rfind("line 4: libmujoco cannot read it: Error: sizes must be positive", 0) == 0);
  CHECK(refusal(world("<site/>\n\n<body><geom name='" + std::string(200, 'g') + "' size='0'/></body>"))
            .rfind("line 5: ", 0) == 0);
  const std::string told = refusal(world("\n<geom size='one'/>"));
  CHECK(told.rfind("line 4: ", 0) == 0);
  CHECK(told.find("line ", 1) == std::string::npos);  // none of the text that libmujoco was given
}

TEST_CASE("frames vanish: their children stand where the frames put them, in the links that have them") {
  if (skips()) return;
  // A quarter about z, then 1 along x of that: (0, 1, 0) from (2, 0, 0). The classes are those of the frames.
  const scenes::Robot robot = read(mujoco(
      "<default><default class='big'><geom size='.5'/></default><default class='box'><geom type='box' size='1 2 3'/>"
      "</default></default><worldbody><frame pos='2 0 0' euler='0 0 90' childclass='big'><geom name='g' pos='1 0 0'/>"
      "<body name='a' pos='0 1 0'><joint name='j'/><geom/><frame pos='0 0 1' axisangle='1 0 0 180' childclass='box'>"
      "<frame pos='0 0 1'><geom pos='1 0 0'/></frame><body name='b' pos='0 1 0'><geom class='big'/></body></frame>"
      "</body></frame></worldbody>"));
  CHECK(robot.body.link_names == std::vector<std::string>{"world", "a", "b"});
  CHECK(robot.body.link_parents == std::vector<std::int32_t>{-1, 0, 1});
  REQUIRE(robot.body.leaves.size() == 4);
  std::vector<scenes::Vec3> places;
  for (const scenes::Vec3& place : centres(robot)) places.push_back(place);
  std::vector<std::uint32_t> links;
  std::vector<float> sizes;
  for (const scenes::BodyLeaf& leaf : robot.body.leaves) {
    links.push_back(leaf.link);
    sizes.push_back(leaf.parts[0].shape.size[0]);
  }
  CHECK(links == std::vector<std::uint32_t>{0, 1, 1, 2});
  CHECK(sizes == std::vector<float>{.5f, .5f, 1, .5f});
  check_near(places[0], {2, 1, 0});
  check_near(places[1], {1, 0, 0});
  check_near(places[2], {1, 1, 0});  // 1 up, turned over x, so 1 down again; 1 along x, which is y
  check_near(places[3], {2, 0, 1});
  CHECK(robot.body.leaves[2].parts[0].shape.kind == ShapeKind::kBox);
  // A body with a free joint in a frame of the world floats, as one directly below the world does.
  const scenes::Robot free =
      read(world("<frame pos='1 0 0'><body name='a'><freejoint/>" + kBall + "</body><body name='c' mocap='true'>" +
                 kBall + "</body></frame><body>" + kBall + "<joint/></body>"));
  CHECK(free.links[1].floats);
  CHECK(free.links[2].floats);
  CHECK(!free.links[3].floats);
  CHECK(has_note(free, "mocap bodies are held where they are: 1"));
  CHECK(refusal(world("<body>" + kBall + "<joint/><frame><body><freejoint/>" + kBall + "</body></frame></body>"))
            .find("free joint") != std::string::npos);
}

TEST_CASE("replicate: each copy is one offset and one rotation further, with a number after its names") {
  if (skips()) return;
  const scenes::Robot robot =
      read(world("<replicate count='10' sep='-' offset='1 0 0' euler='0 0 90'><body name='a'><joint name='j'/>" +
                 kBall + "</body></replicate>"));
  REQUIRE(robot.body.link_names.size() == 11);
  CHECK(robot.body.link_names[1] == "a-00");
  CHECK(robot.body.link_names[10] == "a-09");
  CHECK(robot.variables[3].name == "j-03");
  const std::vector<scenes::Vec3> places = centres(robot);
  for (std::size_t k = 0; k < 10; ++k) {  // around a square
    const std::vector<scenes::Vec3> square = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    check_near(places[k], square[k % 4]);
  }
  const scenes::Robot nested = read(mujoco(
      "<compiler angle='radian' eulerseq='ZYX'/><worldbody><replicate count='2' offset='0 0 5'><replicate count='2' "
      "euler='.1 .2 .3' offset='0 1 0'><body name='a'><geom size='.1' pos='1 2 3'/></body></replicate>"
      "</replicate></worldbody>"));
  CHECK(nested.body.link_names == std::vector<std::string>{"world", "a00", "a10", "a01", "a11"});
  // The rotation is that of libmujoco, which is asked for the same angles.
  const scenes::Robot turned = read(
      mujoco("<compiler angle='radian' eulerseq='ZYX'/><worldbody><body pos='0 1 5' euler='.1 .2 .3'><geom size='.1' "
             "pos='1 2 3'/></body></worldbody>"));
  check_near(centres(nested)[3], centres(turned)[0]);
  CHECK(refusal(world("<replicate count='2'><body name='a'>" + kBall + "</body></replicate>")
                    .replace(0, 9, "<mujoco>\n<contact><exclude body1='a' body2='world'/></contact>"))
            .find("<exclude> names a, which a <replicate> repeats") != std::string::npos);
  for (const char* count : {"", "0", "-1", "two", "1e9", "1000000"}) {
    CAPTURE(std::string(count));
    CHECK(refusal(world("<replicate count='" + std::string(count) + "'>" + kBall + "</replicate>"))
              .find("line 3: <replicate>: count is not a number from 1 to 999999") == 0);
  }
  CHECK(refusal(world("<replicate count='2' offset='1 2'>" + kBall + "</replicate>")).find("offset is not three") !=
        std::string::npos);
}

TEST_CASE("files that repeat or include without end are refused") {
  std::string nested = kBall;
  for (int k = 0; k < 8; ++k) nested = "<replicate count='999999'>" + nested + "</replicate>";
  CHECK(refusal(world(nested)).find("the robot is too large") != std::string::npos);
  std::string empty = "<camera/>";
  for (int k = 0; k < 8; ++k) empty = "<replicate count='99'>" + empty + "</replicate>";
  CHECK(refusal(world(empty)).find("the robot is too large") != std::string::npos);

  if (skips()) return;
  const TemporaryFile first("r.xml", mujoco("<include file='0.xml'/>"));
  for (int k = 0; k < 150; ++k)
    std::ofstream(first.directory() / (std::to_string(k) + ".xml")) << "<m><include file='" << k + 1 << ".xml'/></m>";
  CHECK_THROWS_WITH_AS(scenes::import_robot(first.path(), {}), doctest::Contains("more than 100 included files"),
                       scenes::ImportError);
  std::string deep, closed;
  for (int k = 0; k < 40; ++k) deep += "<body>", closed += "</body>";
  const TemporaryFile outer("r.xml", world("<include file='0.xml'/>"));
  for (int k = 0; k < 6; ++k)
    std::ofstream(outer.directory() / (std::to_string(k) + ".xml"))
        << "<m>" << deep << "<include file='" << k + 1 << ".xml'/>" << closed << "</m>";
  CHECK_THROWS_WITH_AS(scenes::import_robot(outer.path(), {}), doctest::Contains("elements nest deeper than 90"),
                       scenes::ImportError);
}

TEST_CASE("included files: their elements and words are those of the file, told with both names") {
  if (skips()) return;
  const TemporaryFile file("r.xml", "");
  const std::filesystem::path below = file.directory() / "parts";
  std::filesystem::create_directories(below);
  const auto write = [&](const char* name, const std::string& text) { std::ofstream(file.directory() / name) << text; };
  const auto told = [&](const std::string& text) {
    write("r.xml", text);
    std::vector<std::string> lines;
    for (const auto& sandbox : {std::optional<scenes::SandboxLimits>(), std::optional(scenes::kImportSandbox)}) {
      scenes::RobotOptions options;
      options.sandbox = sandbox;
      try {
        lines.push_back(std::to_string(scenes::import_robot(file.path(), options).body.leaves.size()));
      } catch (const scenes::ImportError& error) {
        lines.push_back(std::string(error.what()).substr(file.path().size() + 2));
      }
    }
    CHECK(lines[0] == lines[1]);
    return lines[0];
  };
  const std::string in_part = "in " + (below / "part.xml").string() + ": ";
  // part.xml stands beside no.xml, and MuJoCo looks beside the main file first.
  write("parts/part.xml", "<mujocoinclude>\n<geom size='1'/>\n<include file='more.xml'/></mujocoinclude>");
  write("parts/more.xml", "<m><body><geom size='1'/></body></m>");
  CHECK(told(world("<include file='parts/part.xml'/>")) == "2");
  write("more.xml", "<m><body><geom size='1'/><geom size='2'/></body></m>");
  CHECK(told(world("<include file='parts/part.xml'/>")) == "3");
  CHECK(told(world("<include file='parts/part.xml'/><include file='parts/part.xml'/>")) ==
        "line 3: <include>: parts/part.xml is included already");
  CHECK(told(world("<include file='r.xml'/>")) == "line 3: <include>: r.xml is included already");
  CHECK(told(world("<include/>")) == "line 3: <include> without a file");
  CHECK(told(world("<include file='no.xml'/>")).find("line 3: <include>: no such file: ") == 0);
  write("parts/part.xml", "<m>\n<geom size='1' later='2'/></m>");
  CHECK(told(world("<include file='parts/part.xml'/>")).find(in_part + "line 2: <geom> has the attribute later") == 0);
  write("parts/part.xml", "<m>\n<geom>");
  CHECK(told(world("<include file='parts/part.xml'/>")).find("not well-formed XML") != std::string::npos);
  write("parts/part.xml", "<m>\n\n<geom size='0'/></m>");
  CHECK(told(world("<include file='parts/part.xml'/>")).find(in_part + "line 3: libmujoco cannot read it: ") == 0);
}

TEST_CASE("only the meshes of shapes are opened, and one that is not there is named with its line") {
  if (skips()) return;
  const std::string assets =
      "<asset><mesh name='m' file='lost.stl'/>\n<mesh file='skin.dae'/><texture file='no.png'/></asset>";
  const std::string look =
      "<default><default class='visual'><geom type='mesh' contype='0' conaffinity='0'/></default></default>";
  const scenes::Robot robot = read(mujoco(look + assets +
                                          "<worldbody><geom class='visual' mesh='m'/><body "
                                          "childclass='visual'><geom mesh='skin' material='no'/><geom "
                                          "class='main' size='1'/></body></worldbody>"));
  CHECK(robot.body.leaves.size() == 1);
  CHECK(has_note(robot, "<geom> without contact bits 2"));
  CHECK(has_note(robot, "<mesh> of no shape 2"));
  const std::string told = refusal(mujoco(assets + "<worldbody><geom type='mesh' mesh='m'/></worldbody>"));
  CHECK(told.rfind("line 2: mesh lost.stl: no such file: ", 0) == 0);
  // A height field is left out, so its file is not opened.
  const scenes::Robot field = read(mujoco("<asset><hfield name='h' file='no.png' size='1 1 1 1'/></asset><worldbody>" +
                                          kBall + "<geom type='hfield' hfield='h'/></worldbody>"));
  CHECK(has_note(field, "planes and height fields are left out: 1"));
}

TEST_CASE("MJCF: all objects and groups of an OBJ file are one mesh, in hulls, in triangles and for fitted geoms") {
  const TemporaryFile file("r.xml", "");
  const std::string first = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
  const std::string second = "v 5 0 0\nv 6 0 0\nv 5 1 0\nv 5 0 1\nf 5 7 6\nf 5 6 8\nf 5 8 7\nf 6 7 8\n";
  const auto write = [&](const std::string& objects, const std::string& attributes) {
    std::ofstream(file.directory() / "two.obj", std::ios::binary) << objects;
    std::ofstream(file.path()) << mujoco("<asset><mesh name='m' file='two.obj' " + attributes +
                                         "/></asset><worldbody><body><joint range='-1 1'/><geom type='mesh' mesh='m'/>"
                                         "<geom type='box' mesh='m'/></body></worldbody>");
  };
  // A file of one object is libmujoco's.
  for (const std::string& one : {first + second, "o a\ng b\n" + first + "# o b\n" + second}) {
    write(one, "");
    CHECK(scenes::mjcf_text(scenes::XmlText(file.path()), {}).xml.find("two.obj") != std::string::npos);
  }
  if (skips()) return;
  struct Placed {
    std::string attributes;
    float least, greatest;  // along x
  };
  for (const std::string& objects : {"o a\n" + first + "o b\n" + second, first + "\r\n\tg b\r\n" + second})
    for (const Placed& placed :
         {Placed{"", 0, 6}, Placed{"scale='-2 1 1' refpos='1 0 0'", -10, 2}, Placed{"refquat='0 0 0 1'", -6, 0}}) {
      CAPTURE(objects);
      CAPTURE(placed.attributes);
      write(objects, placed.attributes);
      const scenes::Robot robot = scenes::import_robot(file.path(), {});
      REQUIRE(robot.body.leaves.size() == 2);
      const std::vector<float>& vertices = robot.body.leaves[0].parts[0].vertices;
      float least = vertices[0], greatest = vertices[0];
      for (std::size_t v = 0; v < vertices.size(); v += 3) {
        least = std::min(least, vertices[v]);
        greatest = std::max(greatest, vertices[v]);
      }
      CHECK(std::fabs(least - placed.least) < 1e-5f);
      CHECK(std::fabs(greatest - placed.greatest) < 1e-5f);
      CHECK(scenes::import_triangles(file.path(), {})[0].size() == 8 * 9);
      // That of the first object alone is more than two off.
      CHECK(std::fabs(centres(robot)[1][0] - .5 * (placed.least + placed.greatest)) < 1);
    }
  write("o a\n" + first + "o b\nv 5 0 nan\nf 1 2 5\n", "");
  CHECK_THROWS_WITH_AS(scenes::import_robot(file.path(), {}),
                       doctest::Contains("line 2: mesh two.obj: a vertex is not a number"), scenes::ImportError);
}

TEST_CASE("MJCF: words by which libmujoco would fit a geom to a mesh wrongly are refused, if a geom is fitted") {
  struct Fit {
    std::string compiler, defaults, mesh, geom;
    std::string told;
  };
  const auto text = [](const Fit& fit, const std::string& type) {
    return mujoco(
        "<compiler " + fit.compiler + "/><default>" + fit.defaults + "</default><asset><mesh name='m' " + fit.mesh +
        " vertex='1 0 0 3 0 0 1 1 0 3 1 0 1 0 1 3 0 1 1 1 1 3 1 1'/></asset>\n<worldbody><body><joint/><geom " +
        fit.geom + " mesh='m' type='" + type + "'/></body></worldbody>");
  };
  const std::string fitted = "line 3: a geom is fitted to a mesh by ", wrong = ", which libmujoco 2.2.2 does wrong; ";
  const std::string inertia =
      "line 2: <mesh> has the attribute inertia, which is not read, and a geom is fitted to it; ";
  for (const auto& [fit, word] : std::vector<std::pair<Fit, std::string>>{
           {{"fitaabb='true'", "", "", "", fitted + "fitaabb" + wrong}, "fitaabb"},
           {{"", "", "", "shellinertia='true'", fitted + "shellinertia" + wrong}, "shellinertia"},
           {{"", "<geom shellinertia='true'/>", "", "", fitted + "shellinertia" + wrong}, "shellinertia"},
           {{"", "", "inertia='exact'", "", inertia}, "inertia"},
           {{"", "<mesh inertia='shell'/>", "", "", inertia}, "inertia"},
           {{"fitaabb='false'", "", "inertia='legacy'", "shellinertia='false'", ""}, ""}}) {
    const std::string box = text(fit, "box");
    CAPTURE(box);
    CHECK(refusal(box) == (word.empty() ? word : fit.told + "--ignore " + word + " passes it over"));
    CHECK(refusal(text(fit, "mesh")).empty());
    if (!scenes::reads_mjcf()) continue;
    check_near(centres(read(box, ignoring(word)))[0], {2, .5, .5});
  }
  if (skips()) return;
  // The box of an L has its centre where the mass of the L is.
  for (const auto& [compiler, centre] :
       {std::pair<std::string, double>("exactmeshinertia='true'", 1.1), {"exactmeshinertia='false'", 1.1209553}}) {
    const scenes::Robot robot = read(mujoco(
        "<compiler " + compiler +
        "/><asset><mesh name='m' vertex='0 0 0 3 0 0 3 1 0 1 1 0 1 3 0 0 3 0 0 0 1 3 0 1 3 1 1 1 1 1 1 3 1 0 3 1' "
        "face='0 2 1 6 7 8 0 3 2 6 8 9 0 5 3 6 9 11 3 5 4 9 10 11 0 1 7 0 7 6 1 2 8 1 8 7 2 3 9 2 9 8 3 4 10 3 10 9 4 "
        "5 11 4 11 10 5 0 6 5 6 11'/></asset><worldbody><geom type='box' mesh='m'/></worldbody>"));
    check_near(centres(robot)[0], {centre, centre, .5});
    CHECK_FALSE(has_note(robot, "exactmeshinertia"));
  }
}

TEST_CASE("bodies without joints are one rigid body with their parents, and MuJoCo does not test its neighbours") {
  if (skips()) return;
  const std::string ball = "<geom size='.1'/>";
  const auto body = [&](const std::string& name, const std::string& inside) {
    return "<body name='" + name + "'>" + ball + inside + "</body>";
  };
  const std::string tree =
      body("pelvis", "<freejoint/>" + body("block", "<body name='bare'>" + body("tip", "") + "</body>") +
                         body("back", "<joint/>" + body("plate", "") + body("arm", "<joint/>")));
  const scenes::Robot robot = read(world(tree + body("fixed", body("door", "<joint/>"))));
  REQUIRE(robot.mujoco);
  CHECK(named(robot, robot.mujoco->welded) ==
        Pairs{{"back", "plate"}, {"block", "tip"}, {"pelvis", "block"}, {"pelvis", "tip"}});
  // The door turns about what is fixed in the world, and MuJoCo tests it against that.
  CHECK(named(robot, robot.mujoco->adjacent) == Pairs{{"back", "arm"},
                                                      {"block", "back"},
                                                      {"block", "plate"},
                                                      {"pelvis", "back"},
                                                      {"pelvis", "plate"},
                                                      {"plate", "arm"},
                                                      {"tip", "back"},
                                                      {"tip", "plate"}});
  CHECK(robot.mujoco->listed.empty());
  CHECK(robot.body.ignored_pairs.empty());
  const scenes::Robot all =
      read(mujoco("<option><flag filterparent='disable'/></option><worldbody>" + tree + "</worldbody>"));
  CHECK(all.mujoco->adjacent.empty());
  CHECK(all.mujoco->welded.size() == 4);
  const scenes::Robot mocap = read(world("<geom size='1'/>" + std::string("<body name='m' mocap='true'>") + ball +
                                         "</body>" + body("free", "<freejoint/>")));
  CHECK(named(mocap, mocap.mujoco->welded) == Pairs{{"world", "m"}});
}

TEST_CASE("listed pairs are tested whatever contact bits, exclusions and adjacency say") {
  if (skips()) return;
  const auto body = [](const std::string& name, const std::string& bits, const std::string& inside) {
    return "<body name='" + name + "'><joint/><geom name='g" + name + "' size='.1' " + bits + "/>" + inside + "</body>";
  };
  const std::string none = "contype='0' conaffinity='0'";
  const std::string bodies = "<worldbody>" + body("a", none, body("b", none, "")) + body("c", "", "") +
                             body("d", "contype='2' conaffinity='4'", "") + "</worldbody>";
  const std::string contact =
      "<contact><pair geom1='ga' geom2='gb'/><pair geom1='gd' geom2='gc'/><exclude body1='c' body2='d'/></contact>";
  const scenes::Robot robot = read(mujoco(bodies + contact));
  CHECK(robot.body.leaves.size() == 4);
  CHECK(named(robot, robot.mujoco->listed) == Pairs{{"a", "b"}, {"c", "d"}});
  CHECK(named(robot, robot.body.ignored_pairs) == Pairs{{"a", "c"}, {"a", "d"}, {"b", "c"}, {"b", "d"}});
  CHECK(robot.mujoco->adjacent.empty());
  // Files from before MuJoCo 3 may test listed pairs only, or no listed pairs.
  const scenes::Robot only =
      read(mujoco("<option collision='predefined'/>" + contact + "<worldbody>" + body("a", "", body("b", "", "")) +
                  body("c", "", "") + body("d", "", "") + "</worldbody>"));
  CHECK(only.body.ignored_pairs.size() == 4);
  CHECK(only.mujoco->listed.size() == 2);
  const scenes::Robot no_list = read(mujoco("<option collision='dynamic'/>" + contact + bodies));
  CHECK(no_list.mujoco->listed.empty());
  CHECK(no_list.body.leaves.size() == 2);
  // A body is tested with all its geoms, which a note says where the file tests some of them.
  const scenes::Robot mixed = read(world("<body><joint/>" + kBall +
                                         "<geom size='.1' contype='2' conaffinity='2'/></body>"
                                         "<body><joint/>" +
                                         kBall + "</body>"));
  CHECK(has_note(mixed, "the file tests some geoms only; all their geoms are tested: 1"));
}

}  // namespace cab::tests
