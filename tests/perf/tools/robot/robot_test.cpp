// `cab robot`: the allowed-collision matrix, self-collision and distances of robots whose answers are known in closed
// form, and of a real hand.
#include <cab/cab.h>
#include <cab/record.h>
#include <cab/replay.h>
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <string>
#include <tuple>
#include <vector>

#include "scenes/robot/kinematics.h"
#include "scenes/robot/matrix.h"
#include "tests/perf/cli/spawn.h"

namespace cab::tests {
namespace {

using Json = nlohmann::json;
using Words = std::vector<std::string>;
using MatrixRow = std::tuple<std::string, std::string, std::string>;  // two links and the reason

std::string link(const std::string& name, const std::string& geometry) {
  const std::string shape = "<collision><geometry>" + geometry + "</geometry></collision>";
  return "<link name='" + name + "'>" + (geometry.empty() ? "" : shape) + "</link>\n";
}

std::string joint(const std::string& type, const std::string& parent, const std::string& child,
                  const std::string& xyz) {
  return "<joint name='" + child + "_joint' type='" + type + "'><parent link='" + parent + "'/><child link='" + child +
         "'/><origin xyz='" + xyz +
         "'/><axis xyz='1 0 0'/><limit lower='0' upper='10' effort='1' velocity='1'/></joint>\n";
}

// Balls of radius 1 whose joints slide them along x by 0 to 10: base at 0; slider from 3 on; far, 100 beside it; wide,
// 8 behind it; and ring from 0 on, which hangs on the base by a link without a shape.
std::string known_robot() {
  const std::string ball = "<sphere radius='1'/>";
  return "<robot name='known'>" + link("base", ball) + link("slider", ball) + link("far", ball) + link("mid", "") +
         link("ring", ball) + link("wide", ball) + joint("prismatic", "base", "slider", "3 0 0") +
         joint("prismatic", "slider", "far", "0 100 0") + joint("fixed", "base", "mid", "0 0 50") +
         joint("prismatic", "mid", "ring", "0 0 -50") + joint("prismatic", "slider", "wide", "-8 0 0") + "</robot>";
}

struct KnownRobot {
  TemporaryFolder folder;
  std::string file = folder / "known.urdf";
  KnownRobot() { write_text(file, known_robot()); }

  Json run(const Words& options) const {
    const std::string path = folder / "out.json";
    Words words = {file, "--json", path};
    words.insert(words.end(), options.begin(), options.end());
    const Outcome outcome = run_command("robot", words);
    INFO(outcome.error);
    REQUIRE(outcome.exit_code == 0);
    Json json = Json::parse(read_text(path));
    json["printed"] = outcome.out;
    json["told"] = outcome.error;
    return json;
  }
};

std::set<MatrixRow> matrix_of(const Json& json) {
  std::set<MatrixRow> rows;
  for (const Json& row : json["masked"]) rows.emplace(row["link_a"], row["link_b"], row["reason"]);
  return rows;
}

// How many hits a recording of so many frames has.
std::size_t recorded_hits(const std::string& file, std::uint32_t frames) {
  record::Recording recording;
  REQUIRE(recording.open(file.c_str()));
  REQUIRE(recording.frame_count() == frames);
  std::size_t found = 0;
  for (std::uint32_t f = 0; f < frames; ++f) {
    record::RecordedFrame frame;
    REQUIRE(recording.read_frame(f, &frame));
    found += frame.hits.size;
  }
  return found;
}

// The allegro hand of the data, or an empty path with a printed reason.
std::string allegro() {
  const char* data = std::getenv("CAB_DATA_DIR");
  if (data == nullptr) {
    MESSAGE("skipped: CAB_DATA_DIR is not set");
    return {};
  }
  return std::string(data) + "/robots/allegro_hand/allegro_hand_right.urdf";
}

}  // namespace

TEST_CASE("the matrix masks adjacent links over links without shapes, and pairs that touch never") {
  const KnownRobot known;
  const Json json = known.run({"--samples", "2000", "--random", "500"});
  // `far` comes near nobody: of its four pairs one is adjacent.
  const std::set<MatrixRow> rows = matrix_of(json);
  CHECK(rows.count({"base", "slider", "adjacent"}) == 1);
  CHECK(rows.count({"slider", "far", "adjacent"}) == 1);
  CHECK(rows.count({"slider", "wide", "adjacent"}) == 1);
  CHECK(rows.count({"base", "ring", "adjacent"}) == 1);
  for (const char* const other : {"base", "ring", "wide"})
    CHECK(rows.count({"far", other, "never"}) + rows.count({other, "far", "never"}) == 1);
  CHECK(rows.size() == 7);
  CHECK(json["pair_count"] == 10);
  CHECK(json["links"].size() == 6);
  CHECK(json["states"] == 500);
  // wide stands at slider - 8 + 0..10, so at -5 + u + v; it touches the base within 2 of 0, and the others sometimes.
  std::set<std::string> touching;
  for (const Json& pair : json["pairs"])
    touching.insert(std::string(pair["link_a"]) + "-" + std::string(pair["link_b"]));
  CHECK(touching.count("base-wide") == 1);
  CHECK(json["states_in_self_collision"] > 0);
  CHECK(json["states_in_self_collision"] < 500);
}

TEST_CASE("pairs that touch in nearly all sampled states are masked, and those that touch at rest alone are tested") {
  const TemporaryFolder folder;
  const std::string file = folder / "r.urdf", out = folder / "out.json";
  const std::string ball = "<sphere radius='1'/>";
  const auto slide = [](const std::string& child, double x, double length) {
    return "<joint name='" + child + "_joint' type='prismatic'><parent link='b'/><child link='" + child +
           "'/><origin xyz='" + std::to_string(x) + " -50 0'/><axis xyz='1 0 0'/><limit lower='0' upper='" +
           std::to_string(length) + "'/></joint>\n";
  };
  // Balls of radius 1, of which b only carries. From a, c is 1.5 to 11.5 away, d 1.5 to 1.6, and e 2.01 to 1.01.
  write_text(file, "<robot name='r'>" + link("a", ball) + link("b", ball) + link("c", ball) + link("d", ball) +
                       link("e", ball) + joint("fixed", "a", "b", "0 50 0") + slide("c", 1.5, 10) +
                       slide("d", 1.5, .1) +
                       "<joint name='e_joint' type='prismatic'><parent link='b'/><child link='e'/>"
                       "<origin xyz='0 -50 2.01'/><axis xyz='0 0 -1'/><limit lower='0' upper='1'/></joint></robot>");
  const auto run = [&](Words options) {
    options.insert(options.begin(), {file, "--json", out});
    const Outcome outcome = run_command("robot", options);
    INFO(outcome.error);
    REQUIRE(outcome.exit_code == 0);
    Json json = Json::parse(read_text(out));
    json["printed"] = outcome.out;
    return json;
  };
  const auto rest_pairs = [](const Json& json) {
    std::set<std::string> names;
    for (const Json& pair : json["touch_at_rest_and_tested"])
      names.insert(std::string(pair["link_a"]) + std::string(pair["link_b"]));
    return names;
  };
  const Json json = run({"--samples", "1000"});
  const std::set<MatrixRow> rows = matrix_of(json);
  CHECK(rows.count({"a", "d", "default"}) == 1);
  CHECK(rows.count({"a", "e", "always"}) == 1);
  CHECK(rows.count({"a", "b", "adjacent"}) == 1);
  for (const Json& row : json["masked"]) {
    const std::string reason = row["reason"];
    CHECK(row.contains("share") == (reason != "adjacent"));
    if (reason == "default") CHECK(row["share"] == 1);
    if (reason == "always") CHECK((row["share"] >= .98 && row["share"] < 1));
    if (reason == "never") CHECK(row["share"] == 0);
  }
  // c and d are 0 to 10 apart, and begin at one place.
  CHECK(rest_pairs(json) == std::set<std::string>{"ac", "cd"});
  CHECK(double{json["touch_at_rest_and_tested"][0]["share"]} == doctest::Approx(.05).epsilon(.4));
  const std::string printed = json["printed"];
  CHECK(printed.find("\npairs that touch at rest, but in less than 95 % of the samples, and are tested: 2: a - c (") !=
        std::string::npos);
  CHECK(printed.find("\na        d  default               100.0 %\n") != std::string::npos);
  const Json& summary = json["summary"];
  CHECK(summary["masked"]["default"] == 1);
  CHECK(summary["touch_at_rest_and_tested"] == 2);
  CHECK(std::size_t{summary["tested_pairs"]} + json["masked"].size() == std::size_t{json["pair_count"]});
  // Nothing is sampled, so nothing is masked but what is adjacent.
  const Json bare = run({"--samples", "0"});
  for (const Json& row : bare["masked"]) CHECK(row["reason"] == "adjacent");
  CHECK(rest_pairs(bare) == std::set<std::string>{"ac", "ad", "cd"});
  CHECK(std::string(bare["printed"]).find("\npairs that touch at rest, and are tested: 3: a - c, a - d, c - d\n") !=
        std::string::npos);
  // Another rest state: c far away, e in a.
  const Json other = run({"--samples", "1000", "--rest", "c_joint=9,e_joint=.5"});
  CHECK(rest_pairs(other).empty());
  CHECK(matrix_of(other).count({"a", "e", "default"}) == 1);
  CHECK(other["variables"][0]["rest"] == 9);
}

TEST_CASE("the summary says how rare what was never sampled may be, and how many pairs are left out") {
  const KnownRobot known;
  const Json json = known.run({"--samples", "2000", "--random", "100"});
  // A share p is missed by 2000 samples with a probability of (1 - p)^2000.
  CHECK(double{json["summary"]["never_at_most"]} == doctest::Approx(1 - std::pow(.05, 1. / 2000)));
  CHECK(std::pow(1 - double{json["summary"]["never_at_most"]}, 2000) == doctest::Approx(.05));
  const std::string printed = json["printed"];
  CHECK(printed.find("each in at most 0.15 % of states (95 % confidence)\n") != std::string::npos);
  CHECK(printed.find("without 7 masked pairs\n") != std::string::npos);
  CHECK(std::string(known.run({"--samples", "10000", "--random", "1"})["printed"]).find("at most 0.03 % of states") !=
        std::string::npos);
  CHECK(std::string(known.run({"--samples", "3", "--random", "1"})["printed"]).find("at most 64 % of states") !=
        std::string::npos);
  CHECK_FALSE(known.run({"--samples", "0", "--random", "1"})["summary"].contains("never_at_most"));
}

TEST_CASE("tools of two arms without other shapes are tested against each other") {
  const TemporaryFolder folder;
  const std::string file = folder / "dual.urdf", states = folder / "dual.csv", hits = folder / "hits.csv";
  const auto turn = [](const std::string& parent, const std::string& child, const std::string& xyz) {
    return "<joint name='" + child + "_joint' type='revolute'><parent link='" + parent + "'/><child link='" + child +
           "'/><origin xyz='" + xyz + "'/><axis xyz='0 0 1'/><limit lower='-3' upper='3'/></joint>\n";
  };
  std::string text = "<robot name='dual'>" + link("torso", "");
  for (const std::string side : {"l", "r"})
    text += link(side + "1", "") + link(side + "2", "") + link(side + "_tool", "<box size='.2 .1 .1'/>") +
            turn("torso", side + "1", side == "l" ? "0 .3 0" : "0 -.3 0") + turn(side + "1", side + "2", ".3 0 0") +
            joint("fixed", side + "2", side + "_tool", ".1 0 0");
  write_text(file, text + "</robot>");
  // Each arm reaches over to the middle: the tools cross at x = .283.
  write_text(states, "\xef\xbb\xbfl1_joint,l2_joint,r1_joint,r2_joint\n-0.785,0,0.785,0\n0,0,0,0\n");
  const Outcome outcome = run_command("robot", {file, "--states", states, "--hits", hits, "--samples", "0"});
  INFO(outcome.error);
  REQUIRE(outcome.exit_code == 0);
  CHECK(read_text(hits) == "state,link_a,link_b\n0,l_tool,r_tool\n");
}

TEST_CASE("distances of named links are the least and greatest over given states, and hits name the state") {
  const KnownRobot known;
  const std::string states = known.folder / "states.csv", hits = known.folder / "hits.csv";
  write_text(states, "slider_joint,wide_joint\n0,0\n2,1\n3,1.5\n10,10\n");
  const Json json = known.run(
      {"--states", states, "--samples", "0", "--distance", "wide,base", "--distance", "base,far", "--hits", hits});
  REQUIRE(json["distances"].size() == 2);
  // wide is at x = -5 + slider + wide: -5, -2, -.5, 15.
  const Json& wide = json["distances"][0];
  CHECK(wide["link_a"] == "base");
  CHECK(wide["link_b"] == "wide");
  CHECK(double{wide["least_metres"]} == doctest::Approx(-1.5));
  CHECK(wide["least_state"] == 2);
  CHECK(double{wide["greatest_metres"]} == doctest::Approx(13));
  CHECK(wide["greatest_state"] == 3);
  // far is 100 to the side, at x = 3 + slider.
  CHECK(double{json["distances"][1]["least_metres"]} == doctest::Approx(std::sqrt(10000. + 9) - 2));
  const std::string text = read_text(hits);
  CHECK(text.rfind("state,link_a,link_b\n", 0) == 0);
  CHECK(text.find("\n2,base,wide\n") != std::string::npos);
  CHECK(text.find("\n3,base,wide\n") == std::string::npos);
  CHECK(std::string(json["told"]).find("2 joints without a column stay at rest") != std::string::npos);
}

TEST_CASE("an SRDF file is the matrix, and nothing else is masked") {
  const KnownRobot known;
  const std::string srdf = known.folder / "r.srdf";
  write_text(srdf, "<robot name='known'><disable_collisions link1='ring' link2='base' reason='Never'/></robot>");
  const Json json = known.run({"--srdf", srdf});
  CHECK((matrix_of(json) == std::set<MatrixRow>{{"base", "ring", "file"}}));
}

TEST_CASE("hits of random states depend on the seed, not on the instruction set, threads or their number") {
  const KnownRobot known;
  const auto hits = [&](Words options, const std::string& count = "5000") {
    const std::string path = known.folder / "hits.csv";
    options.insert(options.end(), {"--samples", "100", "--random", count, "--hits", path});
    known.run(options);
    return read_text(path);
  };
  const std::string expected = hits({});
  CHECK(expected.size() > 1000);
  CHECK((hits({"--isa", "scalar"}) == expected));
  CHECK((hits({"--threads", "2", "--strategy", "brute"}) == expected));
  const std::string fewer = hits({}, "4097");
  CHECK(fewer.size() > 1000);
  CHECK(expected.rfind(fewer, 0) == 0);
  CHECK((hits({"--seed", "2"}) != expected));
}

TEST_CASE("bodies around the robot touch it where they stand at rest, and a margin counts") {
  const KnownRobot robot;
  const std::string cell = robot.folder / "cell.urdf", states = robot.folder / "states.csv";
  // At rest the wall begins at x = 12; slider reaches it from 11 - 3 on.
  write_text(cell, "<robot name='cell'>" + link("post", "<sphere radius='1'/>") + link("wall", "<box size='2 2 2'/>") +
                       joint("prismatic", "post", "wall", "13 0 0") +
                       "<joint name='p' type='fixed'><parent link='root'/><child link='post'/></joint>" +
                       "<link name='root'/></robot>");
  write_text(states, "slider_joint,far_joint,ring_joint,wide_joint\n7.9,0,10,10\n8.1,0,10,10\n7.4,0,10,10\n");
  const auto pairs_of = [](const Json& json) {
    std::set<std::tuple<std::string, std::string, int, int>> out;
    for (const Json& pair : json["pairs"])
      out.emplace(pair["link_a"], pair["link_b"], pair["states"], pair["first_state"]);
    return out;
  };
  const Words base = {"--samples", "0", "--states", states, "--around", cell};
  Json json = robot.run(base);
  CHECK(pairs_of(json).count({"slider", "cell/wall", 1, 1}) == 1);
  CHECK(pairs_of(json).count({"base", "cell/post", 3, 0}) == 1);
  CHECK(json["states_in_collision"] == 3);
  Words with_margin = base;
  with_margin.insert(with_margin.end(), {"--margin", "0.25"});
  CHECK(pairs_of(robot.run(with_margin)).count({"slider", "cell/wall", 2, 0}) == 1);
  CHECK(pairs_of(robot.run({"--samples", "0", "--states", states})).count({"slider", "cell/wall", 1, 1}) == 0);

  // A recording has the same hits.
  const std::string recording = robot.folder / "r.cab";
  with_margin.insert(with_margin.end(), {"--record", recording});
  json = robot.run(with_margin);
  CHECK(json["hits"] == recorded_hits(recording, 3));
}

TEST_CASE("links that touch in no sample are tested with a margin that they come within, and beyond limits") {
  const KnownRobot robot;
  const auto count_never = [](const Json& json) {
    return std::count_if(json["masked"].begin(), json["masked"].end(),
                         [](const Json& pair) { return pair["reason"] == "never"; });
  };
  // far is 100 beside all others, less two radii.
  const Json apart = robot.run({"--margin", "97.9"}), near = robot.run({"--margin", "99"});
  CHECK(count_never(apart) == count_never(robot.run({})));
  CHECK(count_never(apart) > count_never(near));
  CHECK(std::any_of(near["pairs"].begin(), near["pairs"].end(), [](const Json& pair) {
    return pair["link_a"] == "base" && pair["link_b"] == "far" && pair["states"] > 0;
  }));
  const std::string states = robot.folder / "states.csv";
  write_text(states, "slider_joint,far_joint\n10,0\n");
  CHECK(count_never(robot.run({"--states", states})) == count_never(apart));
  write_text(states, "slider_joint,far_joint\n10.1,0\n");
  CHECK(count_never(robot.run({"--states", states})) == 0);
}

TEST_CASE("padding counts against what stands around, for all links or for one, and not between links") {
  const KnownRobot robot;
  const std::string cell = robot.folder / "cell.urdf", states = robot.folder / "states.csv",
                    hits = robot.folder / "hits.csv", recording = robot.folder / "r.cab";
  // The wall begins at x = 12, and slider ends at 11.9, 12.1 and 11.4; base and ring are 0.1 apart in the last state.
  write_text(cell, "<robot name='cell'>" + link("wall", "<box size='2 2 2'/>") + link("post", "<sphere radius='.1'/>") +
                       "<link name='root'/><joint name='w' type='fixed'><parent link='root'/><child link='wall'/>" +
                       "<origin xyz='13 0 0'/></joint><joint name='p' type='fixed'><parent link='root'/>" +
                       "<child link='post'/></joint></robot>");
  write_text(states, "slider_joint,far_joint,ring_joint,wide_joint\n7.9,0,10,10\n8.1,0,10,10\n7.4,0,2.1,10\n");
  const Words base = {"--srdf", robot.folder / "none.srdf", "--states", states, "--hits", hits};
  write_text(robot.folder / "none.srdf", "<robot name='known'></robot>");
  // The states in which slider touches the wall, the number of states that collide, and the hits of links alone.
  const auto run = [&](Words options) {
    options.insert(options.begin(), base.begin(), base.end());
    const Json json = robot.run(options);
    std::set<std::string> with_wall, between;
    std::istringstream lines(read_text(hits));
    std::string line, last;
    std::getline(lines, line);
    while (std::getline(lines, line)) {
      CHECK(line.substr(0, 1) >= last);
      last = line.substr(0, 1);
      if (line.find("slider,cell/wall") != std::string::npos) with_wall.insert(last);
      if (line.find("cell/") == std::string::npos) between.insert(line);
    }
    const auto colliding = json.contains("states_in_collision") ? json["states_in_collision"] : Json(-1);
    return std::tuple(with_wall, colliding.get<int>(), between);
  };
  using Set = std::set<std::string>;
  const auto with = [&](const std::string& padding) { return run({"--around", cell, "--padding", padding}); };
  const Set between = std::get<2>(run({}));
  const auto plain = run({"--around", cell});
  CHECK((std::get<0>(plain) == Set{"1"}));
  CHECK((std::get<0>(with(".25")) == Set{"0", "1"}));
  CHECK((std::get<0>(with("0.75")) == Set{"0", "1", "2"}));
  CHECK((std::get<0>(with("slider=.25")) == Set{"0", "1"}));
  CHECK((std::get<0>(with(".75,slider=0")) == Set{"1"}));
  CHECK(
      (std::get<0>(run({"--around", cell, "--padding", "slider=.75", "--padding", "0,base=1"})) == Set{"0", "1", "2"}));
  for (const auto& got : {plain, with("0.75"), with("9")}) {
    CHECK(std::get<1>(got) == 3);  // base touches the post
    CHECK(std::get<2>(got) == between);
  }

  // A recording has the same hits.
  run({"--around", cell, "--padding", ".25", "--record", recording});
  const std::string text = read_text(hits);
  const auto rows = std::count(text.begin(), text.end(), '\n') - 1;
  CHECK(recorded_hits(recording, 3) == static_cast<std::size_t>(rows));
}

TEST_CASE("surfaces leave out what hulls touch in a gap of a mesh, also of what stands around") {
  // The base is two plates at x = 0 and x = 4, whose hull fills the gap. A plate slides along x through it.
  const TemporaryFolder folder;
  const std::string file = folder / "r.urdf", out = folder / "out.json", states = folder / "states.csv";
  write_text(folder / "two.obj", "v 0 -1 -1\nv 0 1 -1\nv 0 0 1\nv 4 -1 -1\nv 4 1 -1\nv 4 0 1\nf 1 2 3\nf 4 5 6\n");
  write_text(folder / "bar.obj", "v -1 0 0\nv 1 0 0.1\nv 1 0.1 0\nf 1 2 3\n");
  write_text(file, "<robot name='r'>" + link("base", "<mesh filename='two.obj'/>") +
                       link("bar", "<mesh filename='bar.obj'/>") + joint("prismatic", "base", "bar", "0 0 0") +
                       "</robot>");
  write_text(folder / "cell.urdf",
             "<robot name='cell'><link name='gate'><collision><origin xyz='6 0 0'/><geometry><mesh filename='two.obj'/>"
             "</geometry></collision></link></robot>");
  const std::string all = "<robot name='r'/>",
                    none = "<robot name='r'><disable_collisions link1='base' link2='bar' reason='x'/></robot>";
  write_text(states, "bar_joint\n0\n0.5\n2\n3.5\n4.5\n5.5\n8\n");
  const auto colliding = [&](const std::string& shapes, const std::string& srdf, const Words& more) {
    write_text(folder / "r.srdf", srdf);
    Words words = {file, "--shapes", shapes, "--srdf", folder / "r.srdf", "--states", states, "--json", out};
    words.insert(words.end(), more.begin(), more.end());
    const Outcome outcome = run_command("robot", words);
    INFO(outcome.error);
    REQUIRE(outcome.exit_code == 0);
    const Json json = Json::parse(read_text(out));
    CHECK(json["policies"]["exact"] == (shapes == "hulls" ? "convex" : "surface"));
    return json[json.contains("states_in_collision") ? "states_in_collision" : "states_in_self_collision"].get<int>();
  };
  CHECK(colliding("hulls", all, {}) == 5);
  CHECK(colliding("surface", all, {}) == 4);
  CHECK(colliding("surface", all, {"--margin", "0.45"}) == 4);
  CHECK(colliding("surface", all, {"--margin", "0.55"}) == 5);
  CHECK(colliding("surface", all, {"--threads", "2", "--isa", "scalar"}) == 4);
  CHECK(colliding("hulls", none, {"--around", folder / "cell.urdf"}) == 2);
  CHECK(colliding("surface", none, {"--around", folder / "cell.urdf", "--record", folder / "r.cab"}) == 1);
  CHECK(recorded_hits(folder / "r.cab", 7) == 1);
  CHECK(colliding("surface", all, {"--record", folder / "r.cab"}) == 4);
  CHECK(recorded_hits(folder / "r.cab", 7) == 4);
}

TEST_CASE("wrong use of cab robot is told") {
  const KnownRobot known;
  const std::vector<std::pair<Words, std::string>> wrong = {
      {{}, "FILE"},
      {{known.file, "--package", "name"}, "--package: 'name' is not NAME=DIR"},
      {{known.file, "--missing-mesh", "maybe"}, "--missing-mesh: 'maybe' is not refuse, none"},
      {{known.file, "--missing-mesh", "0"}, "--missing-mesh"},
      {{known.file, "--distance", "base"}, "--distance: 'base' is not A,B"},
      {{known.file, "--distance", "base,base"}, "--distance: 'base' is named twice"},
      {{known.file, "--distance", "base,hand"}, "--distance: the robot has no link 'hand'"},
      {{known.file, "--distance", "base,mid"}, "--distance: the link 'mid' has no shape"},
      {{known.file, "--random", "0"}, "--random"},
      {{known.file, "--rest", "slider_joint"}, "--rest: 'slider_joint' is not JOINT=VALUE"},
      {{known.file, "--rest", "slider_joint=x"}, "--rest: 'slider_joint=x' is not JOINT=VALUE"},
      {{known.file, "--rest", "mid_joint=1"}, "--rest: the robot has no joint 'mid_joint' that moves"},
      {{known.file, "--rest", "slider_joint=1,slider_joint=2"}, "--rest: 'slider_joint' is given twice"},
      {{known.file, "--json", known.file}, "is an input"},
      {{known.file, "--padding", "0.1"}, "--padding: it is against what stands around; give that by --around"},
      {{known.file, "--around", known.file, "--padding", "-1"}, "--padding: '-1' is not METRES or LINK=METRES"},
      {{known.file, "--around", known.file, "--padding", "base=nan"}, "--padding: 'base=nan' is not METRES"},
      {{known.file, "--around", known.file, "--padding", "base="}, "--padding: 'base=' is not METRES"},
      {{known.file, "--around", known.file, "--padding", "hand=1"}, "--padding: the robot has no link 'hand'"},
      {{known.file, "--around", known.file, "--padding", "mid=1"}, "--padding: the link 'mid' has no shape"},
      {{known.file, "--around", known.file, "--padding", "1,2"}, "--padding: a length for all links is given twice"},
      {{known.file, "--around", known.file, "--padding", "base=1,base=2"}, "--padding: 'base' is given twice"},
      {{known.file, "--shapes", "boxes"}, "--shapes: 'boxes' is not hulls or surface"},
      {{known.file, "--exact", "surface"}, "--exact surface: needs --shapes surface, whose triangles it tests"},
      {{known.file, "--shapes", "surface", "--exact", "convex"}, "--shapes surface: the exact tests convex and fcl"},
      {{known.file, "--shapes", "surface", "--distance", "base,ring"}, "--distance: triangles have no depth"},
      {{known.file, "--shapes", "surface", "--around", known.file, "--padding", "1"}, "--padding: triangles are not"},
  };
  for (const auto& [words, told] : wrong) {
    const Outcome outcome = run_command("robot", words);
    CAPTURE(outcome.error);
    CHECK(outcome.exit_code == 2);
    CHECK(outcome.error.find(told) != std::string::npos);
  }
  const Outcome lost = run_command("robot", {known.folder / "lost.urdf"});
  CHECK(lost.exit_code == 1);
  CHECK(lost.error.find("lost.urdf: no such file") != std::string::npos);
}

TEST_CASE("the Allegro hand touches nothing at rest, and its thumb meets its fingers when driven to them") {
  const std::string file = allegro();
  if (file.empty()) return;
  const TemporaryFolder folder;
  const std::string states = folder / "states.csv", out = folder / "out.json", hits = folder / "hits.csv";
  // At rest; then the index finger and the thumb bent towards each other.
  write_text(states,
             "joint_0.0,joint_1.0,joint_2.0,joint_3.0,joint_12.0,joint_13.0,joint_14.0,joint_15.0\n"
             "0,0,0,0,0.83,0,0,0\n"
             "0.14,1.25,0.78,1.1,0.9,0.52,0.76,0.69\n");
  const Outcome outcome = run_command(
      "robot", {file, "--json", out, "--states", states, "--hits", hits, "--distance", "link_3.0_tip,link_15.0_tip"});
  INFO(outcome.error);
  REQUIRE(outcome.exit_code == 0);
  const Json json = Json::parse(read_text(out));
  CHECK(json["links"].size() == 23);
  CHECK(read_text(hits) ==
        "state,link_a,link_b\n1,link_3.0,link_15.0_tip\n1,link_3.0_tip,link_15.0\n1,link_3.0_tip,link_15.0_tip\n");
  const Json& tips = json["distances"][0];
  CHECK(tips["least_state"] == 1);
  CHECK(double{tips["least_metres"]} < -.015);
  CHECK(double{tips["greatest_metres"]} > .2);
  // Links that a joint connects are never reported.
  const std::set<MatrixRow> rows = matrix_of(json);
  for (const char* const tip : {"3", "7", "11", "15"}) {
    const std::string last = std::string("link_") + tip + ".0";
    CHECK(rows.count({last, last + "_tip", "adjacent"}) == 1);
  }
  for (const char* const first : {"link_0.0", "link_4.0", "link_8.0", "link_12.0"})
    CHECK(rows.count({"base_link", first, "adjacent"}) == 1);
}

namespace {

// A robot of MJCF with states and options: what the JSON says, with the hits.
Json run_mjcf(const std::string& text, const std::string& states, const Words& options = {}) {
  const TemporaryFolder folder;
  const std::string file = folder / "r.xml", csv = folder / "states.csv", out = folder / "out.json";
  const std::string hits = folder / "hits.csv";
  write_text(file, text);
  write_text(csv, states);
  Words words = {file, "--samples", "0", "--states", csv, "--json", out, "--hits", hits};
  words.insert(words.end(), options.begin(), options.end());
  const Outcome outcome = run_command("robot", words);
  INFO(outcome.error);
  REQUIRE(outcome.exit_code == 0);
  Json json = Json::parse(read_text(out));
  json["hits_file"] = read_text(hits);
  json["printed"] = outcome.out;
  return json;
}

bool skips_mjcf() {
  if (!scenes::reads_mjcf()) MESSAGE("skipped: libmujoco is not built in");
  return !scenes::reads_mjcf();
}

}  // namespace

TEST_CASE("an MJCF file newer than libmujoco has the hits of MuJoCo 3") {
  if (skips_mjcf()) return;
  // Folded back by 3.1 about y at z = .5, the arm of length .45 ends at z = .0504; its radius reaches into the base.
  const Json json = run_mjcf(R"(<mujoco model="arm">
  <compiler angle="radian"/>
  <option><flag nativeccd="enable"/></option>
  <worldbody>
    <body name="base" gravcomp="1"><geom type="box" size=".05 .05 .05"/>
      <body name="link1" pos="0 0 .15"><joint name="j1" axis="0 1 0" range="-2 2" actuatorfrcrange="-50 50"/>
        <geom type="capsule" fromto="0 0 0 0 0 .3" size=".03"/>
        <frame pos="0 0 .3"><body name="link2" pos="0 0 .05">
          <joint name="j2" axis="0 1 0" range="-3.1 3.1" actuatorfrcrange="-50 50"/>
          <geom type="capsule" fromto="0 0 0 0 0 .45" size=".03"/></body></frame></body></body>
  </worldbody>
  <actuator><position name="a1" joint="j1" kp="10" kv="1"/></actuator>
  <sensor><jointactuatorfrc name="s1" joint="j1"/></sensor>
</mujoco>)",
                             "j1,j2\n0,3.1\n0,1\n", {"--distance", "base,link2"});
  CHECK(json["hits_file"] == "state,link_a,link_b\n0,base,link2\n");
  // The axis ends at (.45 sin 3.1, .5 + .45 cos 3.1), over the base's top at .05.
  CHECK(double{json["distances"][0]["least_metres"]} ==
        doctest::Approx(.5 + .45 * std::cos(3.1) - .05 - .03).epsilon(1e-4));
  CHECK(json["variables"][1]["upper"] == 3.1);
  REQUIRE(json["notes"].size() == 2);
  CHECK(std::string(json["notes"][0]).find("<actuator> 1, <sensor> 1, actuatorfrcrange 2, gravcomp 1") !=
        std::string::npos);
}

TEST_CASE("MJCF: rigid bodies and their neighbours are masked by name, and listed pairs never") {
  if (skips_mjcf()) return;
  const Json weld = run_mjcf(R"(<mujoco><worldbody><body name="pelvis"><freejoint/><geom type="sphere" size=".1"/>
    <body name="hip_block" pos="0 .2 .1"><geom type="sphere" size=".08"/></body>
    <body name="back" pos="0 0 .15"><joint name="b" axis="1 0 0" range="-60 60"/>
      <geom type="capsule" fromto="0 0 0 0 0 .2" size=".08"/></body></body></worldbody></mujoco>)",
                             "b\n-1.0472\n0\n");
  CHECK(weld["hits"] == 0);
  CHECK(matrix_of(weld) == std::set<MatrixRow>{{"pelvis", "hip_block", "welded"},
                                               {"pelvis", "back", "adjacent"},
                                               {"hip_block", "back", "adjacent"}});
  CHECK(std::string(weld["printed"]).find("masked: welded") != std::string::npos);
  // At rest a touches both b and c, which masks no listed pair.
  const std::string bodies = R"(<worldbody>
    <body name="a"><geom name="ga" type="sphere" size=".1" contype="0" conaffinity="0"/></body>
    <body name="b" pos=".15 0 0"><joint name="jb" type="slide" axis="1 0 0" range="-.2 .5"/>
      <geom name="gb" type="sphere" size=".1" contype="0" conaffinity="0"/></body>
    <body name="c" pos="0 .15 0"><joint name="jc" type="slide" axis="0 1 0" range="-.2 .5"/>
      <geom name="gc" type="sphere" size=".1" contype="2" conaffinity="4"/></body></worldbody>)";
  const Json pair = run_mjcf(
      "<mujoco>" + bodies + "<contact><pair geom1='ga' geom2='gb'/><pair geom1='ga' geom2='gc'/></contact></mujoco>",
      "jb,jc\n0,.5\n.5,0\n.5,.5\n");
  CHECK(pair["hits_file"] == "state,link_a,link_b\n0,a,b\n1,a,c\n");
  CHECK(matrix_of(pair) == std::set<MatrixRow>{{"b", "c", "file"}});
}

TEST_CASE("MJCF: unknown words and far meshes name the option that has them read") {
  if (skips_mjcf()) return;
  const std::string text = "<mujoco><worldbody><body><geom size='1' later='2'/></body></worldbody></mujoco>";
  const TemporaryFolder folder;
  const std::string file = folder / "r.xml";
  write_text(file, text);
  const Outcome refused = run_command("robot", {file});
  CHECK(refused.exit_code == 1);
  CHECK(refused.error.find("line 1: <geom> has the attribute later") != std::string::npos);
  CHECK(refused.error.find("--ignore later") != std::string::npos);
  const Outcome read = run_command("robot", {file, "--ignore", "later", "--ignore", "other"});
  CHECK(read.exit_code == 0);
  CHECK(read.error.find("passed over by --ignore: later 1, other 0") != std::string::npos);
  const Outcome lost = run_command("robot", {file, "--root", folder / "lost"});
  CHECK(lost.exit_code == 2);
  CHECK(lost.error.find("--root") != std::string::npos);
}

}  // namespace cab::tests
