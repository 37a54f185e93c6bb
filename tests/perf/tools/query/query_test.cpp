// `cab query` from outside: what it finds, writes and refuses.
#include <cab/cab.h>
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "tests/perf/cli/made_motion.h"
#include "tests/perf/cli/spawn.h"

namespace cab::tests {
namespace {

using Json = nlohmann::json;
using Words = std::vector<std::string>;

Words operator+(Words words, const Words& more) {
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

Outcome query(const Words& options) { return run_command("query", options); }

// The lines of a file of hits, each as its fields.
std::vector<Words> rows_of(const std::string& path) {
  std::vector<Words> rows;
  std::istringstream text(read_text(path));
  for (std::string line; std::getline(text, line);) {
    Words& fields = rows.emplace_back();
    std::istringstream stream(line + ",");
    for (std::string field; std::getline(stream, field, ',');) fields.push_back(field);
  }
  return rows;
}

// Queries of every kind beside and in a figure 1.8 m tall.
struct Files {
  TemporaryFolder folder;
  std::string motion = folder / "anna.bvh", rays = folder / "rays.csv", spheres = folder / "spheres.csv",
              boxes = folder / "boxes.csv", capsules = folder / "capsules.csv", points = folder / "points.csv",
              out = folder / "hits.csv", json = folder / "query.json";
  Files() {
    write_text(motion, bvh_text({5, 0, 0, .5}));
    write_text(rays, "ox,oy,oz,dx,dy,dz,length,radius\n5,.9,0,-1,0,0,inf,0\n0,9,0,0,1,0,9,0\n0,9,0,0,-1,0,9,.1\n");
    write_text(spheres, "x,y,z,radius\n0,1,0,.3\n");
    write_text(boxes, "x,y,z,hx,hy,hz\n0,1,0,.2,.2,.2\n9,9,9,1,1,1\n");
    write_text(capsules, "x,y,z,radius,half\n0,1,0,.1,.4\n");
    write_text(points, "x,y,z,distance\n0,1,2,inf\n0,1,2,.1\n");
  }
  Words all() const {
    return {"--points", points, "--capsules", capsules, "--boxes", boxes, "--spheres", spheres, "--rays", rays};
  }
  // Runs with both outputs, and returns the JSON.
  Json figures(const Words& options) const {
    const Outcome outcome = query(options + Words{"--rounds", "1", "--out", out, "--json", json});
    INFO(outcome.error);
    REQUIRE(outcome.exit_code == 0);
    Json figures = Json::parse(read_text(json));
    CHECK(outcome.out.find(figures["hits_hash"].get<std::string>()) != std::string::npos);
    return figures;
  }
};

using Vec3 = std::array<double, 3>;

// Where a line from a point enters the box of `cab inspect`, or infinity.
double entry(const Json& box, const Vec3& origin, const Vec3& from, const Vec3& direction) {
  double enter = 0, leave = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < 3; ++k) {
    double at = 0, along = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      const double axis = box["axes"][k][c];
      at += axis * (from[c] - origin[c] - box["center_metres"][c].get<double>());
      along += axis * direction[c];
    }
    const double half = box["half_metres"][k];
    const double a = (-half - at) / along, b = (half - at) / along;
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  return enter <= leave ? enter : std::numeric_limits<double>::infinity();
}

}  // namespace

TEST_CASE("cab query asks files of every kind, in the order of kinds and rows, and names what they find") {
  const Files files;
  const Json json = files.figures(Words{files.motion} + files.all());
  const std::vector<Words> rows = rows_of(files.out);
  REQUIRE(rows.size() > 1);
  CHECK(rows[0] == Words{"frame", "file", "row", "kind", "target", "instance", "link", "leaf", "distance_metres",
                         "point_x", "point_y", "point_z", "normal_x", "normal_y", "normal_z", "inside"});
  Words asked;
  for (std::size_t r = 1; r < rows.size(); ++r) {
    REQUIRE(rows[r].size() == rows[0].size());
    asked.push_back(rows[r][3] + " " + rows[r][2]);
    CHECK(rows[r][0] == "0");
    CHECK(rows[r][4] == "anna.bvh");
    CHECK(rows[r][5] == "0");
    CHECK(!rows[r][6].empty());
  }
  CHECK(asked == Words{"rays 0", "rays 2", "spheres 0", "boxes 0", "capsules 0", "points 0"});
  CHECK(rows[1][1] == files.rays);
  REQUIRE(json["sources"].size() == 5);
  CHECK(json["sources"][0]["kind"] == "rays");
  CHECK(json["sources"][0]["queries"] == 3);
  CHECK(json["sources"][0]["found"] == 2);
  CHECK(json["sources"][4]["found"] == 1);
  CHECK(json["queries"] == 9);
  CHECK(json["targets"] == 1);
  CHECK(json["instances_masked"] == 0);
  for (const char* phase : {"total_wall", "bound_thread", "index_thread", "search_thread"})
    CHECK(json[std::string(phase) + "_seconds_least"] <= json[std::string(phase) + "_seconds_median"]);
}

TEST_CASE("a ray at the box of a link has the distance that a hand calculates from the boxes of cab inspect") {
  const Files files;
  for (const char* frame : {"0", "3"}) {
    const Outcome inspected = run_command("inspect", {files.motion, "--json", "--frame", frame});
    REQUIRE(inspected.exit_code == 0);
    const Json boxes = Json::parse(inspected.out);
    const Vec3 origin = boxes["world_origin_metres"];
    std::string text = "ox,oy,oz,dx,dy,dz,length\n";
    std::vector<double> expected;
    for (const Json& leaf : boxes["leaves"])
      for (std::size_t k = 0; k < 3; ++k) {
        Vec3 from, direction;
        for (std::size_t c = 0; c < 3; ++c) {
          direction[c] = -leaf["box"]["axes"][k][c].get<double>() + .01 * static_cast<double>(c);
          from[c] = origin[c] + leaf["box"]["center_metres"][c].get<double>() - 3 * direction[c];
        }
        std::ostringstream line;
        line.precision(17);
        for (const double number : from) line << number << ',';
        for (const double number : direction) line << number << ',';
        text += line.str() + "inf\n";
        double nearest = std::numeric_limits<double>::infinity();
        for (const Json& other : boxes["leaves"])
          nearest = std::min(nearest, entry(other["box"], origin, from, direction));
        expected.push_back(nearest * std::hypot(direction[0], direction[1], direction[2]));
      }
    write_text(files.rays, text);
    files.figures({files.motion, "--frame", frame, "--rays", files.rays});
    const std::vector<Words> rows = rows_of(files.out);
    REQUIRE(rows.size() == expected.size() + 1);
    for (std::size_t r = 0; r < expected.size(); ++r) {
      CAPTURE(r);
      CHECK(std::stod(rows[r + 1][8]) == doctest::Approx(expected[r]).epsilon(1e-5));
    }
  }
}

TEST_CASE("cab query has the same hits on every instruction set and thread count") {
  const Files files;
  Words models = {files.motion, "--frames"};
  if (std::filesystem::exists("/usr/share/assimp/models/BVH/01_01.bvh"))
    models = {"/usr/share/assimp/models/BVH/01_01.bvh", "--units", ".0564", "--frames", "0:3"};
  const std::vector<Words> worlds = {
      {"--scene", "uniform", "--characters", "200", "--random", "300", "--frame", "2"},
      {"--scene", "level", "--characters", "100", "--random", "300", "--want", "all", "--exact", "convex"},
      Words{"--scene", "spot", "--characters", "20", "--depth", "--want", "all"} + files.all(),
      Words{"--exact", "convex", "--want", "all"} + models,
      Words{files.motion, "--frames", "--exact", "convex", "--depth"} + files.all(),
      {"--scene", "uniform", "--characters", "200", "--random", "300", "--want", "any"},
  };
  for (const Words& world : worlds) {
    CAPTURE(world[1]);
    const Json expected = files.figures(world + Words{"--isa", "scalar"});
    const std::string hits = read_text(files.out);
    CHECK(hits.find('\n') + 1 < hits.size());
    for (std::uint8_t i = 0; i < kIsaCount; ++i) {
      const Isa isa = static_cast<Isa>(i);
      if (!isa_available(isa)) continue;
      CAPTURE(to_string(isa));
      const Json json = files.figures(world + Words{"--isa", to_string(isa), "--threads", "2"});
      CHECK(json["hits_hash"] == expected["hits_hash"]);
      CHECK(json["instances"] == expected["instances"]);
      CHECK(json["leaf_tests"] == expected["leaf_tests"]);
      CHECK((read_text(files.out) == hits));
    }
  }
}

TEST_CASE("--want and --max-hits say how many hits a query has") {
  const Files files;
  write_text(files.spheres, "x,y,z,radius\n0,0,0,1000\n5000,0,0,1\n");
  const Words asked = {"--scene", "jitter", "--characters", "20", "--spheres", files.spheres};
  const auto hits = [&](const Words& options) {
    const Json json = files.figures(asked + options);
    CHECK(json["sources"][0]["found"] == 1);
    return json["sources"][0]["hits"].get<int>();
  };
  CHECK(hits({}) == 1);
  CHECK(hits({"--want", "all"}) == 20 * 16);
  CHECK(hits({"--want", "all", "--max-hits", "7"}) == 7);
  CHECK(hits({"--want", "any"}) == 0);
  const std::vector<Words> rows = rows_of(files.out);
  REQUIRE(rows.size() == 2);
  CHECK(rows[1][3] == "spheres");
  CHECK(rows[1][6].empty());
}

TEST_CASE("--frames asks in all frames of files, or in some") {
  const Files files;
  const auto frames = [&](const Words& options) {
    files.figures(Words{files.motion, "--points", files.points} + options);
    Words out;
    for (const Words& row : rows_of(files.out))
      if (row[0] != "frame") out.push_back(row[0]);
    return out;
  };
  CHECK(frames({}) == Words{"0"});
  CHECK(frames({"--frame", "last"}) == Words{"4"});
  CHECK(frames({"--frames"}) == Words{"0", "1", "2", "3", "4"});
  CHECK(frames({"--frames", "1:3"}) == Words{"1", "2"});
}

TEST_CASE("random rays depend on the seed alone") {
  const Files files;
  const Words scene = {"--scene", "uniform", "--characters", "50", "--random", "100"};
  const Json given = files.figures(scene);
  CHECK(given["seed"] == 1);
  CHECK(given["sources"][0]["found"] == 100);
  CHECK(files.figures(scene)["hits_hash"] == given["hits_hash"]);
  CHECK(files.figures(scene + Words{"--seed", "1"})["hits_hash"] == given["hits_hash"]);
  CHECK(files.figures(scene + Words{"--seed", "2"})["hits_hash"] != given["hits_hash"]);
}

TEST_CASE("cab query warns of targets that are masked, and names the first") {
  const Files files;
  const std::string joint = "OFFSET 0 9e8 0\nCHANNELS 3 Zrotation Xrotation Yrotation\n";
  write_text(files.motion,
             "HIERARCHY\nROOT hips\n{\nOFFSET 0 0 0\nCHANNELS 3 Xposition Yposition Zposition\nJOINT a\n{\n" + joint +
                 "JOINT b\n{\n" + joint +
                 "End Site\n{\nOFFSET 0 9e8 0\n}\n}\n}\n}\nMOTION\nFrames: 1\nFrame Time: 0.04\n"
                 "0 0 0 0 0 0 0 0 0\n");
  const Outcome outcome = query({files.motion, "--units", "1e9", "--rays", files.rays});
  CHECK(outcome.exit_code == 0);
  CHECK(outcome.error.find("warning: 1 poses of 1 targets in 1 frames are masked: no query finds them\n  the first: "
                           "frame 0 of anna.bvh, instance 0, link 2 (b): number 5 of its pose is 18") !=
        std::string::npos);
}

TEST_CASE("cab query says what was wrong and how to do it right") {
  const Files files;
  struct Misuse {
    Words arguments;
    const char* told;
  };
  const Words scene = {"--scene", "uniform"};
  const std::vector<Misuse> misuses = {
      {{}, "give FILE or --scene NAME"},
      {{"--scene", "party"}, "choose uniform, jitter, spot"},
      {{"--scene", "battle"}, "a crowd scene that needs no clips"},
      {scene + Words{files.motion}, "FILE is not for --scene uniform"},
      {scene + Words{"--units", "2"}, "--units is not for --scene uniform"},
      {scene + Words{"--no-sandbox"}, "--no-sandbox is not for --scene uniform"},
      {scene + Words{"--frame", "last"}, "a scene has no last frame"},
      {scene + Words{"--frame", "4294967295"}, "--frame: '4294967295' is not a frame, counted from 0"},
      {scene + Words{"--frames"}, "a scene has no last frame"},
      {scene + Words{"--frames", "3:3"}, "--frames: '3:3' is not N"},
      {scene + Words{"--frame", "1", "--frames", "1:2"}, "--frame"},
      {scene + Words{"--characters", "0"}, "--characters"},
      {{files.motion, "--characters", "2"}, "--characters requires --scene"},
      {{files.motion, "--frame", "5"}, "--frame: there are frames 0 to 4"},
      {{files.motion, "--frames", "2:6"}, "--frames: there are frames 0 to 4"},
      {{files.motion, "--ray", files.rays}, "did you mean --rays?"},
      {{files.motion, "--rays", ""}, "'' names no file"},
      {{files.motion, "--random", "0"}, "--random"},
      {{files.motion, "--random", "5000000"}, "--random"},
      {{files.motion, "--random", "5", "--rays", files.rays}, "--rays excludes --random"},
      {{files.motion, "--exact", "fcl"}, "--exact: 'fcl' is not what decides; choose none, convex"},
      {{files.motion, "--want", "some"}, "choose any, closest, all"},
      {{files.motion, "--max-hits", "3"}, "--max-hits is for --want all"},
      {{files.motion, "--want", "all", "--max-hits", "0"}, "--max-hits"},
      {{files.motion, "--depth"}, "--depth is for --spheres, --boxes and --capsules"},
      {{files.motion, "--isa", "mmx"}, "scalar"},
      {{files.motion, "--rounds", "0"}, "--rounds"},
      {{files.motion, "--rays", files.rays, "--out", files.rays}, "is an input; write the output to another file"},
      {{files.motion, "--json", files.motion}, "is an input"},
      {{files.motion, "--json", files.out, "--out", files.out}, "same file"},
  };
  const std::string before = read_text(files.rays);
  for (const Misuse& misuse : misuses) {
    std::string shown;
    for (const std::string& word : misuse.arguments) shown += " " + word;
    CAPTURE(shown);
    const Outcome outcome = query(misuse.arguments);
    CAPTURE(outcome.error);
    CHECK(outcome.exit_code == 2);
    CHECK(outcome.out.empty());
    CHECK(outcome.error.find(misuse.told) != std::string::npos);
  }
  CHECK(read_text(files.rays) == before);
}

TEST_CASE("bad files of queries and outputs that cannot be written end cab query with one line") {
  const Files files;
  const auto last_line = [&](const Words& options) {
    const Outcome outcome = query(Words{"--scene", "uniform", "--characters", "5"} + options);
    CHECK(outcome.exit_code == 1);
    CHECK(std::count(outcome.error.begin(), outcome.error.end(), '\n') == 1);
    return outcome.error;
  };
  write_text(files.rays, "ox,oy,oz,dx,dy,dz,length\n0,0,0,1,0,nan,1\n");
  CHECK(last_line({"--rays", files.rays}) ==
        "cab: " + files.rays + ":2: column 6 (dz): 'nan' is not a number from -3.4e38 to 3.4e38\n");
  CHECK(last_line({"--rays", files.folder / "none.csv"}).find("none.csv: no such file") != std::string::npos);
  CHECK(last_line({"--points", files.spheres}).find(files.spheres + ":1: points have no column 'radius'") !=
        std::string::npos);
  CHECK(last_line({"--out", "/dev/full"}).find("/dev/full: No space left on device") != std::string::npos);
  CHECK(last_line({"--out", files.folder / "no/such/folder"}).find("no/such/folder") != std::string::npos);
}

}  // namespace cab::tests
