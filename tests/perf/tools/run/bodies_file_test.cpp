// Bodies of a figure as a JSON file: what is written can be read back, and what cannot be read is named.
#include "perf/tools/run/bodies_file.h"

#include "scenes/import/limits.h"
#include "tests/scenes/rig/stick_figure.h"
#include "tests/scenes/temporary_file.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cstring>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>

namespace cab::tests {
namespace {

// What a file says, which is the same in a child process.
std::vector<scenes::BodyChange> read_both(const std::string& path) {
  const std::vector<scenes::BodyChange> here = perf::read_bodies(path, {});
  const std::vector<scenes::BodyChange> in_child = perf::read_bodies(path, scenes::kImportSandbox);
  const auto same = [](const scenes::BodyChange& a, const scenes::BodyChange& b) {
    return a.link == b.link && a.to == b.to && a.is_solid == b.is_solid && a.kind == b.kind && a.half == b.half &&
           a.radius == b.radius;
  };
  CHECK(std::equal(here.begin(), here.end(), in_child.begin(), in_child.end(), same));
  return here;
}

// Entries of a made file of bodies, as the importer takes them.
std::vector<scenes::BodyChange> read_entries(const std::string& entries) {
  const TemporaryFile file("bodies.json", "{\"bodies\": [" + entries + "]}");
  return read_both(file.path());
}

}  // namespace

TEST_CASE("bodies that are written and read back change nothing, and each is a row of the table") {
  const scenes::Skeleton figure = stick_figure();
  const scenes::Clip clip = scenes::make_clip(figure, "person", {});
  const TemporaryFile file("bodies.json", perf::bodies_json(figure, clip.bodies).dump());
  scenes::ImportOptions options;
  options.body_changes = read_both(file.path());
  CHECK(options.body_changes.size() == clip.bodies.bodies.size());
  const scenes::Clip same = scenes::make_clip(figure, "person", options);
  REQUIRE(same.character.leaves.size() == clip.character.leaves.size());
  for (std::size_t l = 0; l < clip.character.leaves.size(); ++l)
    CHECK(std::memcmp(&same.character.leaves[l].box, &clip.character.leaves[l].box, sizeof(Box)) == 0);

  std::ostringstream table;
  perf::print_bodies(figure, clip.bodies, table);
  const std::string text = table.str();
  CHECK(text.find("stature 1.75 m, from legs and spine") == 0);
  CHECK(static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n')) == clip.bodies.bodies.size() + 2);
}

TEST_CASE("a body is changed to each shape, to a radius, or to none") {
  const auto changes = read_entries(R"({"link": "a", "to": "b", "shape": "capsule", "half_metres": [0.2, 0.05, 0.05]},)"
                                    R"({"link": "a", "to": "-", "shape": "sphere", "radius_metres": 0.1},)"
                                    R"({"link": "b", "to": "-", "shape": "none"})");
  REQUIRE(changes.size() == 3);
  CHECK(changes[0].kind == ShapeKind::kCapsule);
  CHECK(changes[0].half == std::array<double, 3>{.2, .05, .05});
  CHECK(!changes[0].radius);
  CHECK(changes[1].radius == .1);
  CHECK(!changes[2].is_solid);
}

TEST_CASE("files of bodies that cannot be read are refused with the entry and the reason") {
  const auto refused = [](const std::string& entries, const char* reason) {
    CAPTURE(entries);
    CHECK_THROWS_WITH_AS(read_entries(entries), doctest::Contains(reason), std::runtime_error);
  };
  refused("3", "body 1: a body is an object");
  refused("]", "not JSON");
  refused(R"({"link": "a", "shape": "box"})", "body 1: link, to and shape are needed");
  refused(R"({"link": "a", "to": "b", "shape": "cone"})", "unknown shape cone");
  refused(R"({"link": "a", "to": 3, "shape": "box"})", "to is a text");
  refused(R"({"link": "a", "to": "b", "shape": "box", "half": 1})", "unknown key half");
  refused(R"({"link": "a", "to": "b", "shape": "box", "half\n": 1})", "unknown key half?; there are");
  refused(R"({"link": "a", "to": "b", "shape": "cone\n"})", "unknown shape cone?; there are");
  refused(R"({"link": "a", "to": "b", "shape": "box", "half_metres": [1, 2]})", "three lengths");
  refused(R"({"link": "a", "to": "b", "shape": "box", "half_metres": [1, 2, 0]})", "metres above 0");
  refused(R"({"link": "a", "to": "b", "shape": "box", "radius_metres": "1"})", "metres above 0");
  const TemporaryFile file("bodies.json", "{}");
  CHECK_THROWS_WITH_AS(read_both(file.path()), doctest::Contains("no list \"bodies\""), std::runtime_error);
  CHECK_THROWS_WITH_AS(read_both(file.path() + "x"), doctest::Contains("no such file"), std::runtime_error);
  CHECK_THROWS_WITH_AS(read_both("/dev/zero"), doctest::Contains("is not a regular file"), std::runtime_error);
}

}  // namespace cab::tests
