// `cab peers --robot`: what is counted beside the triangles of robots whose answers are known in closed form.
#include <doctest/doctest.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "scenes/robot/kinematics.h"
#include "tests/perf/cli/spawn.h"

namespace cab::tests {
namespace {

using Json = nlohmann::json;
using Words = std::vector<std::string>;

constexpr std::uint32_t kStates = 3000;

// An OBJ file of boxes about centers on the x axis.
std::string boxes_obj(const std::vector<double>& centers, double half_x, double half_yz) {
  std::string text;
  for (std::size_t b = 0; b < centers.size(); ++b) {
    for (int k = 0; k < 8; ++k) {
      text += "v " + std::to_string(centers[b] + (k & 1 ? half_x : -half_x));
      for (const int bit : {2, 4}) text += " " + std::to_string(k & bit ? half_yz : -half_yz);
      text += "\n";
    }
    for (const char* face : {"1243", "5786", "1562", "3487", "1375", "2684"}) {
      text += "f";
      for (int k = 0; k < 4; ++k) text += " " + std::to_string(8 * b + static_cast<std::size_t>(face[k] - '0'));
      text += "\n";
    }
  }
  return text;
}

// The base is one mesh of two cubes, from 0 to 1 and from 3 to 4, with a gap that its hull fills. A plate 0.5 thick
// slides along x through it, twice as far as its joint's value.
struct GapRobot {
  TemporaryFolder folder;
  std::string file = folder / "r.urdf";

  explicit GapRobot(const std::string& plate) {
    write_text(folder / "base.obj", boxes_obj({.5, 3.5}, .5, .5));
    write_text(folder / "plate.obj", boxes_obj({0}, .25, 2));
    write_text(folder / "all.srdf", "<robot name='r'/>");
    const auto link = [](const std::string& name, const std::string& geometry) {
      return "<link name='" + name + "'><collision><geometry>" + geometry + "</geometry></collision></link>\n";
    };
    const auto joint = [](const std::string& name, const std::string& parent, const std::string& more) {
      return "<joint name='" + name + "_joint' type='prismatic'><parent link='" + parent + "'/><child link='" + name +
             "'/><axis xyz='1 0 0'/><limit lower='-1.5' upper='3.5'/>" + more + "</joint>\n";
    };
    write_text(file, "<robot name='r'>" + link("base", "<mesh filename='base.obj'/>") + "<link name='half'/>" +
                         joint("half", "base", "") + link("plate", plate) +
                         joint("plate", "half", "<mimic joint='half_joint'/>") + "</robot>");
  }
};

Json run(const TemporaryFolder& folder, Words options, int exit_code = 0) {
  const std::string path = folder / "out.json";
  options.insert(options.end(), {"--states", std::to_string(kStates), "--rounds", "4", "--json", path});
  const Outcome outcome = run_command("peers", options);
  INFO(outcome.out);
  INFO(outcome.error);
  REQUIRE(outcome.exit_code == exit_code);
  const Json json = Json::parse(read_text(path));
  CHECK(json["runs"].size() >= (scenes::reads_mjcf() ? 5 : 3));
  std::size_t of_mujoco = 0;
  for (const Json& row : json["runs"]) {
    CHECK(row["seconds_least"] > 0);
    CHECK(row["seconds_least"] <= row["seconds_median"]);
    CHECK(row["seconds_median"] <= row["seconds_most"]);
    CHECK(outcome.out.find(row["setup"].get<std::string>() + ": ") != std::string::npos);
    of_mujoco += row["setup"].get<std::string>().rfind("mujoco ", 0) == 0;
  }
  if (json.contains("mujoco_version")) CHECK(of_mujoco == 2);
  return json;
}

}  // namespace

TEST_CASE("cab peers --robot counts as false positives the states in which hulls touch and triangles are apart") {
  // The small ones are often wholly inside a cube.
  for (const std::string plate : {"<box size='.5 4 4'/>", "<mesh filename='plate.obj'/>", "<box size='.5 .5 .5'/>",
                                  "<mesh filename='plate.obj' scale='1 .1 .1'/>"}) {
    CAPTURE(plate);
    const GapRobot gap(plate);
    const scenes::Robot robot = scenes::import_robot(gap.file, {});
    std::uint64_t touching = 0, in_gap = 0;
    for (std::uint32_t s = 0; s < kStates; ++s) {
      double value = 0;
      scenes::random_state(robot, 7, s, &value);
      const double x = 2 * value;  // the plate's middle
      const bool touches = (x > -.25 && x < 1.25) || (x > 2.75 && x < 4.25);
      touching += touches;
      in_gap += !touches && x > -.25 && x < 4.25;
    }
    REQUIRE(in_gap > 300);
    const Json json = run(gap.folder, {"--robot", gap.file, "--srdf", gap.folder / "all.srdf", "--seed", "7"});
    CHECK(json["tested_pairs"] == 1);
    CHECK(json["states_in_collision"] == touching);
    CHECK(json["left_out_pairs"] == kStates - touching - in_gap);
    CHECK(json["left_out_pairs_that_touch"] == 0);
    std::size_t of_triangles = 0;
    for (const Json& row : json["runs"]) {
      CAPTURE(row.dump());
      CHECK(row["misses"] == 0);
      if (row.contains("misses_inside")) {
        // Triangles have no gap to fill, and may have no inside.
        ++of_triangles;
        CHECK(row["false_positives"] == 0);
        CHECK(row["misses_inside"] <= json["states_inside_alone"]);
        CHECK(std::uint64_t{row["states_in_collision"]} + std::uint64_t{row["misses_inside"]} == touching);
      } else {
        CHECK(row["states_in_collision"] == touching + in_gap);
        CHECK(row["false_positives"] == in_gap);
      }
    }
    CHECK(of_triangles == 3);
    const bool is_small = plate.find(".5 .5 .5") != std::string::npos || plate.find("scale") != std::string::npos;
    CHECK((json["states_inside_alone"] > 0) == is_small);
  }
}

TEST_CASE("cab peers --robot --also counts what other shapes of the same robot miss and invent, and refuses another") {
  const GapRobot gap("<mesh filename='plate.obj'/>"), thin("<box size='.1 4 4'/>"), thick("<box size='.9 4 4'/>");
  const Words robot = {"--robot", gap.file, "--srdf", gap.folder / "all.srdf", "--also"};
  const auto run_with = [&](const std::string& also) {
    Words words = robot;
    words.push_back(also);
    const Json json = run(gap.folder, words);
    for (const Json& row : json["runs"])
      if (row["setup"] == "cab also") return row;
    return Json();
  };
  const Json less = run_with(thin.file), more = run_with(thick.file);
  CHECK(less["misses"] > 50);
  CHECK(more["misses"] == 0);
  CHECK(more["false_positives"] > less["false_positives"]);
  std::string other = read_text(gap.file);
  for (std::size_t at = 0; (at = other.find("half", at)) != std::string::npos;) other.replace(at, 4, "part");
  write_text(gap.folder / "other.urdf", other);
  Words words = robot;
  words.push_back(gap.folder / "other.urdf");
  const Outcome outcome = run_command("peers", words);
  CHECK(outcome.exit_code == 1);
  CHECK(outcome.error.find("other.urdf: has other links or joints than the robot") != std::string::npos);
}

TEST_CASE("cab peers --robot gives MuJoCo the same ball joints, hinges off zero, shapes and masks") {
  if (!scenes::reads_mjcf()) {
    MESSAGE("skipped: libmujoco is not built in");
    return;
  }
  const TemporaryFolder folder;
  const std::string file = folder / "r.xml";
  write_text(file, R"(<mujoco><compiler angle='radian'/><worldbody><geom type='box' size='.3 .2 .1' pos='1 .5 0'/>
    <body pos='.1 0 0' euler='.3 0 0'><joint name='shoulder' type='ball'/><geom type='capsule' fromto='0 0 0 1 0 0'
      size='.1'/>
      <body pos='1 0 0'><joint name='elbow' type='hinge' axis='0 1 1' pos='.1 0 0' ref='.5' range='-2 2'
        limited='true'/><geom type='cylinder' size='.2 .3' pos='.5 0 0' euler='0 1 0'/>
        <body pos='.8 0 0'><joint type='slide' axis='1 0 0' range='-1 0' limited='true'/><geom type='ellipsoid'
          size='.1 .2 .3'/></body></body></body>
    <body pos='0 0 1'><geom size='.4'/></body></worldbody></mujoco>)");
  const Json json = run(folder, {"--robot", file});
  CHECK(json["states_in_collision"] > kStates / 20);
  CHECK(json["states_in_collision"] < kStates);
  for (const Json& row : json["runs"]) {
    CAPTURE(row.dump());
    if (row["setup"] == "cab boxes") {
      CHECK(row["false_positives"] > 0);
    } else {
      CHECK(row["false_positives"] <= 2);  // at the threshold; measured: 0
    }
    CHECK(row["misses"] <= (row["setup"].get<std::string>().rfind("cab", 0) == 0 ? 0 : 2));
  }
}

TEST_CASE("cab peers --robot goes with no option of crowds, and its options with nothing else") {
  const GapRobot gap("<box size='.5 4 4'/>");
  struct Misuse {
    Words words;
    const char* told;
  };
  const std::vector<Misuse> misuses = {{{"--robot", gap.file, "--queries"}, "--queries"},
                                       {{"--robot", gap.file, "--scene", "jitter"}, "--scene"},
                                       {{"--robot", gap.file, "--csv", gap.folder / "x"}, "--csv"},
                                       {{"--robot", gap.file, "--json", gap.file}, "--json"},
                                       {{"--robot", gap.file, "--package", "here"}, "--package"},
                                       {{"--states", "10"}, "--robot"},
                                       {{"--srdf", gap.folder / "all.srdf"}, "--robot"}};
  for (const Misuse& misuse : misuses) {
    CAPTURE(misuse.told);
    const Outcome outcome = run_command("peers", misuse.words);
    CAPTURE(outcome.error);
    CHECK(outcome.exit_code == 2);
    CHECK(outcome.error.find(misuse.told) != std::string::npos);
  }
}

}  // namespace cab::tests
