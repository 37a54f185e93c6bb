// `cab peers --surfaces`: skins of a file of arrays, in contact and apart, through every set-up.
#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/perf/cli/spawn.h"

namespace cab::tests {
namespace {

using Json = nlohmann::json;
using Words = std::vector<std::string>;

template <class T>
void append(std::string& bytes, const std::vector<T>& values) {
  bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
}

// A dented tube along z of 12 x 12 quads and radius 0.4, whose upper half bends about x by up to 60 degrees. The bone
// above comes first, so that parents have to be sorted.
std::string tube_file(std::int32_t frames) {
  constexpr std::int32_t kRings = 13, kSides = 12;
  std::vector<double> places, weights, rows;
  std::vector<std::int32_t> bones, triangles;
  for (std::int32_t r = 0; r < kRings; ++r)
    for (std::int32_t s = 0; s < kSides; ++s) {
      const double angle = 2 * std::acos(-1.0) * s / kSides, z = 2.0 * r / (kRings - 1) + .03 * std::sin(5.1 * s + r);
      const double radius = .4 + .03 * std::sin(7 * s + 3.3 * r);  // no corners of two tubes are in one plane
      places.insert(places.end(), {radius * std::cos(angle), radius * std::sin(angle), z});
      const double above = std::min(1.0, std::max(0.0, 2 * (z - .75)));
      weights.insert(weights.end(), {above, 1 - above});
      bones.insert(bones.end(), {0, 1});
      if (r + 1 == kRings) continue;
      const std::int32_t at = r * kSides + s, next = r * kSides + (s + 1) % kSides;
      triangles.insert(triangles.end(), {at, next, at + kSides, next, next + kSides, at + kSides});
    }
  for (std::int32_t f = 0; f < frames; ++f) {
    const double angle = f * std::acos(-1.0) / 3 / frames, c = std::cos(angle), s = std::sin(angle);
    rows.insert(rows.end(), {1, 0, 0, 0, 0, c, -s, s, 0, s, c, 1 - c});  // about (0, 0, 1)
    rows.insert(rows.end(), {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0});
  }
  std::string bytes;
  append(bytes,
         std::vector<std::int32_t>{kRings * kSides, static_cast<std::int32_t>(triangles.size() / 3), 2, frames, 2});
  append(bytes, places);
  append(bytes, bones);
  append(bytes, weights);
  append(bytes, triangles);
  append(bytes, std::vector<std::int32_t>{1, -1});
  append(bytes, rows);
  return bytes;
}

struct Tube {
  TemporaryFolder folder;
  std::string file = folder / "tube.skin";
  Tube() { write_text(file, tube_file(5)); }

  Json run(Words options) const {
    const std::string path = folder / "out.json";
    options.insert(options.end(), {"--rounds", "2", "--json", path});
    const Outcome outcome = run_command("peers", options);
    INFO(outcome.out);
    INFO(outcome.error);
    REQUIRE(outcome.exit_code == 0);
    return Json::parse(read_text(path));
  }
};

}  // namespace

TEST_CASE(
    "cab peers --surfaces: surfaces and their rivals find what the judge finds, and boxes that hold skins no less") {
  const Tube tube;
  for (const Words& more : {Words{"--apart", "0.6"}, Words{"--apart", "0.8", "--surface-characters", "5"}}) {
    Words options = {"--surfaces", tube.file};
    options.insert(options.end(), more.begin(), more.end());
    const Json json = tube.run(options);
    CHECK(json["characters"] == (more.size() > 2 ? 5 : 2));
    CHECK(json["frames"] == 5);
    CHECK(json["touching_triangles"] > 50);
    REQUIRE(json["runs"].size() >= 8);
    std::size_t exact = 0;
    for (const Json& row : json["runs"]) {
      CAPTURE(row.dump());
      const std::string name = row["setup"];
      CHECK(row["seconds_least"] > 0);
      if (name != "boxes that do not grow" && name != "hulls") CHECK(row["missed_links"] == 0);
      if (row.contains("triangles")) {
        ++exact;
        CHECK(row["false_triangles"] <= (name == "surface, triangles" ? 0 : 3));  // rivals round; measured: 0
        CHECK(row["missed_triangles"] == 0);
      }
      if (name.rfind("surface", 0) == 0) CHECK(row["false_links"] == 0);
    }
    CHECK(exact >= 3);
  }
}

TEST_CASE("cab peers --surfaces: tubes that are apart are found by none but boxes, and two files share a clock") {
  const Tube tube;
  const Json apart = tube.run({"--surfaces", tube.file, "--apart", "3"});
  CHECK(apart["touching_triangles"] == 0);
  for (const Json& row : apart["runs"])
    if (row["setup"] != "grown boxes" && row["setup"] != "level" && row["setup"] != "hulls") CHECK(row["links"] == 0);
  const Json same = tube.run({"--surfaces", tube.file, tube.file});
  CHECK(same["touching_links"] >= 5);
  write_text(tube.folder / "long.skin", tube_file(6));
  const Outcome other = run_command("peers", {"--surfaces", tube.file, tube.folder / "long.skin"});
  CHECK(other.exit_code == 1);
  CHECK(other.error.find("long.skin: has other frames than") != std::string::npos);
}

TEST_CASE("cab peers --surfaces refuses damaged arrays and options of crowds") {
  const Tube tube;
  const std::string bytes = tube_file(2);
  const auto refusal = [&](const std::string& damaged) {
    write_text(tube.folder / "bad.skin", damaged);
    const Outcome outcome = run_command("peers", {"--surfaces", tube.folder / "bad.skin"});
    CHECK(outcome.exit_code == 1);
    return outcome.error;
  };
  CHECK(refusal(bytes.substr(0, bytes.size() - 1)).find("bad.skin: no file of a skin's arrays, or cut short") !=
        std::string::npos);
  CHECK(refusal("").find("cut short") != std::string::npos);
  std::string wrong = bytes;
  wrong[3] = '\x7f';
  CHECK(refusal(wrong).find("bad.skin: no file of a skin's arrays") != std::string::npos);
  wrong = bytes;
  wrong[bytes.size() - 2 * 2 * 96 - 4] = '\0';  // the parent of the second bone is the first, whose parent it is
  wrong[bytes.size() - 2 * 2 * 96 - 3] = wrong[bytes.size() - 2 * 2 * 96 - 2] = wrong[bytes.size() - 2 * 2 * 96 - 1] =
      '\0';
  CHECK(refusal(wrong).find("bad.skin: a bone has no such parent, or is above itself") != std::string::npos);
  for (const Words& misuse : {Words{"--queries"}, Words{"--scene", "jitter"}, Words{"--past"}}) {
    Words words = {"--surfaces", tube.file};
    words.insert(words.end(), misuse.begin(), misuse.end());
    const Outcome outcome = run_command("peers", words);
    CHECK(outcome.exit_code == 2);
    CHECK(outcome.error.find(misuse[0]) != std::string::npos);
  }
  CHECK(run_command("peers", {"--apart", "1"}).exit_code == 2);
}

}  // namespace cab::tests
