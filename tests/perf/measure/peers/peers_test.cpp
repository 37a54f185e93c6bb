// `cab peers` from outside: what it verifies, writes and refuses.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/perf/cli/spawn.h"
#include "tests/rounds.h"

namespace cab::tests {
namespace {

using Json = nlohmann::json;
using Words = std::vector<std::string>;

Outcome peers(const Words& options) { return run_command("peers", options); }

bool is_same_run(const Json& a, const Json& b) {
  return a["scene"] == b["scene"] && a["leaves"] == b["leaves"] && a["characters"] == b["characters"];
}

// The median of the row that `best` names.
double seconds_of(const Json& rows, const Json& best) {
  for (const Json& row : rows)
    if (is_same_run(row, best) && row["setup"] == best["setup"]) return row["seconds_median"];
  FAIL("no row of " << best.dump());
  return 0;
}

// Checks that all rows have the same pairs as the judge, up to pairs at the threshold. Bullet loses shallow contacts of
// ellipsoids, a shape that it does not have itself. Worst measured: 3.1 % of the 322 pairs of uniform with 150
// characters, and one of 16 of jitter.
void check_pairs(const Json& rows) {
  constexpr double kLostByBullet = 0.1;
  const auto may_miss = [](const Json& row) {
    const bool is_bullet = row["setup"].get<std::string>().rfind("bullet ", 0) == 0;
    return is_bullet && row["leaves"] == "shapes" ? kLostByBullet * row["pairs"].get<double>() + 2 : 0;
  };
  for (const Json& row : rows) {
    CAPTURE(row.dump());
    CHECK(row["pairs"] > 0);
    CHECK(row["misses"] <= may_miss(row));
    CHECK(row["false_positives"] == 0);
    CHECK(row["threshold_pairs"] <= 0.001 * row["pairs"].get<double>() + 1);
  }
}

}  // namespace

TEST_CASE("cab peers finds the same pairs by every set-up of this build, up to pairs at the threshold") {
  const TemporaryFolder folder;
  const Outcome outcome = peers(
      {"--characters", "150,400", "--rounds", "2", "--json", folder / "peers.json", "--csv", folder / "peers.csv"});
  INFO(outcome.error);
  REQUIRE(outcome.exit_code == 0);
  const Json json = Json::parse(read_text(folder / "peers.json"));
  const std::string missing = json["not_in_this_build"];
  if (!missing.empty()) MESSAGE("not tested: " << missing);
  const Json& small = json["verification"];
  REQUIRE(small.size() > 3);  // FCL is in every build
  Json rows = json["runs"];
  CHECK(rows.size() == 4 * small.size());  // two scenes, two sizes
  rows.insert(rows.end(), small.begin(), small.end());
  check_pairs(rows);
  for (const Json& best : json["best"]) {
    CAPTURE(best.dump());
    for (const Json& row : json["runs"])
      if (is_same_run(row, best) && (row["alone"] == true || best["alone"] == false) && row["misses"] == 0 &&
          row["setup"].get<std::string>().rfind("cab ", 0) != 0)
        CHECK(row["seconds_median"] >= seconds_of(json["runs"], best));
  }
  CHECK(json["best"].size() == 2 * 2 * 4);  // alone, and all together, in each run, by boxes and by shapes
  for (const Json& row : json["runs"]) {
    CAPTURE(row.dump());
    CHECK(row["rounds"] == 2);
    CHECK(row["seconds_least"] > 0);
    CHECK(row["seconds_least"] <= row["seconds_median"]);
    CHECK(row["seconds_median"] <= row["seconds_most"]);
    const auto first = std::find_if(small.begin(), small.end(),
                                    [&row](const Json& verified) { return verified["leaves"] == row["leaves"]; });
    if (row["setup"] == (*first)["setup"]) CHECK(row["ratio_median"] == 1);
    CHECK(outcome.out.find(row["setup"].get<std::string>() + ": ") != std::string::npos);
  }
  const std::string csv = read_text(folder / "peers.csv");
  CHECK(static_cast<std::size_t>(std::count(csv.begin(), csv.end(), '\n')) == json["runs"].size() + 1);
}

TEST_CASE("cab peers gives every set-up the bodies of all groups of a mixed crowd") {
  const TemporaryFolder folder;
  const auto found = [&](const Words& more) {
    Words options = {"--scene", "mixed", "--characters", "100", "--rounds", "1", "--json", folder / "peers.json"};
    options.insert(options.end(), more.begin(), more.end());
    const Outcome outcome = peers(options);
    INFO(outcome.error);
    REQUIRE(outcome.exit_code == 0);
    const Json json = Json::parse(read_text(folder / "peers.json"));
    Json rows = json["runs"];
    CHECK(rows.size() == json["verification"].size());
    rows.insert(rows.end(), json["verification"].begin(), json["verification"].end());
    check_pairs(rows);
    return json["runs"][0]["pairs"].get<double>();
  };
  const double boxes = found({"--leaves", "boxes"}), shapes = found({"--leaves", "shapes", "--peers", "fcl"});
  CHECK(shapes < 0.8 * boxes);  // measured: 0.44
}

TEST_CASE("cab peers runs the libraries that it is told to") {
  const TemporaryFolder folder;
  const Outcome outcome = peers({"--peers", "fcl", "--scene", "jitter", "--characters", "50", "--rounds", "1", "--isa",
                                 "scalar", "--json", folder / "peers.json"});
  INFO(outcome.error);
  REQUIRE(outcome.exit_code == 0);
  const Json json = Json::parse(read_text(folder / "peers.json"));
  CHECK(json["not_in_this_build"] == "");
  for (const Json& row : json["runs"]) {
    const std::string setup = row["setup"];
    CHECK((setup == "cab scalar" || setup == "cab convex scalar" || setup == "cab fcl scalar" ||
           setup.rfind("fcl ", 0) == 0));
    CHECK(row["scene"] == "jitter");
    CHECK(row["characters"] == 50);
  }
}

TEST_CASE("of shapes fewer pairs touch than of their boxes, and cab finds the judge's by either exact test") {
  const TemporaryFolder folder;
  std::vector<double> pairs;
  for (const char* leaves : {"boxes", "shapes"}) {
    const Outcome outcome = peers({"--peers", "fcl", "--scene", "uniform", "--characters", "300", "--rounds", "1",
                                   "--leaves", leaves, "--json", folder / "peers.json"});
    INFO(outcome.error);
    REQUIRE(outcome.exit_code == 0);
    const Json json = Json::parse(read_text(folder / "peers.json"));
    pairs.push_back(json["runs"][0]["pairs"]);
    for (const Json& row : json["runs"]) {
      CAPTURE(row.dump());
      CHECK(row["leaves"] == leaves);
      CHECK(row["misses"] == 0);
      CHECK(row["false_positives"] == 0);
    }
  }
  CHECK(pairs[1] > 0);
  CHECK(pairs[1] < 0.8 * pairs[0]);  // measured: 0.47
}

TEST_CASE("beyond 10 000 characters cab peers runs the set-ups of each library that were best with fewer") {
  if (runs_fewer_rounds()) {
    MESSAGE("skipped with one in several rounds: 10 001 characters take minutes");
    return;
  }
  const TemporaryFolder folder;
  const Outcome outcome = peers({"--peers", "fcl", "--scene", "jitter", "--leaves", "boxes", "--characters",
                                 "10001,100", "--rounds", "1", "--json", folder / "peers.json"});
  INFO(outcome.error);
  REQUIRE(outcome.exit_code == 0);
  CHECK(outcome.out.find("not run, slower with fewer characters: fcl ") != std::string::npos);
  const Json json = Json::parse(read_text(folder / "peers.json"));
  Words fewer, many;
  for (const Json& row : json["runs"]) {
    CAPTURE(row.dump());
    CHECK(row["misses"] == 0);
    CHECK(row["false_positives"] == 0);
    (row["characters"] == 100 ? fewer : many).push_back(row["setup"]);
  }
  CHECK(std::count(fewer.begin(), fewer.end(), "fcl collide") == 1);
  CHECK(std::count(many.begin(), many.end(), "fcl collide") == 1);  // FCL alone has only one
  CHECK(many.size() < fewer.size());
  for (const Json& best : json["best"])
    if (best["characters"] == 100) CHECK(std::count(many.begin(), many.end(), best["setup"]) == 1);
}

TEST_CASE("cab peers --queries: all set-ups agree with the judge, and say which hits they lose") {
  const TemporaryFolder folder;
  const Outcome outcome = peers({"--queries", "--characters", "300", "--rays", "1000", "--rounds", "2", "--json",
                                 folder / "queries.json", "--csv", folder / "queries.csv"});
  INFO(outcome.error);
  REQUIRE(outcome.exit_code == 0);
  const Json json = Json::parse(read_text(folder / "queries.json"));
  const std::string missing = json["not_in_this_build"];
  if (!missing.empty()) MESSAGE("not tested: " << missing);
  const Json& small = json["verification"];
  CHECK(json["runs"].size() == 2 * small.size());  // two scenes
  const auto is_of = [](const Json& row, const char* library) {
    return row["setup"].get<std::string>().rfind(library, 0) == 0;
  };
  // Bullet's casts end about 1 cm short of a box, so that rays that pass a box that close are hits, and rays that begin
  // inside a box pass it. Worst measured, of 3 724 hits: 341 misses by GJK, 58 without; a distance 0.134 m too short at
  // a grazing ray. All others: 4.3e-5 m.
  constexpr double kLostByBullet = 0.2, kOffByBullet = 0.5, kOff = 2e-4;
  for (const char* queries : {"rays", "spheres", "points"}) {
    const auto first =
        std::find_if(small.begin(), small.end(), [&](const Json& row) { return row["queries"] == queries; });
    REQUIRE(first != small.end());
    CHECK(is_of(*first, "cab "));
    const double hits = (*first)["hits"];
    CHECK(hits > 500);
    for (const Json& row : small) {
      if (row["queries"] != queries) continue;
      CAPTURE(row.dump());
      const bool is_bullet_ray = is_of(row, "bullet ") && row["queries"] == "rays";
      CHECK(row["judged"] == (*first)["judged"]);
      CHECK(row["misses"] <= (is_bullet_ray ? kLostByBullet * hits : 0));
      CHECK(row["largest_error"] < (is_bullet_ray ? kOffByBullet : kOff));
      CHECK(row["threshold_hits"] <= 0.002 * hits);
      if (is_bullet_ray) continue;
      CHECK(row["not_inside"] == 0);
      if (row["candidates"] == true) {
        CHECK(row["false_hits"] > 0);  // bounds are larger than spheres
        continue;
      }
      CHECK(row["false_hits"] == 0);
      CHECK(row["inexact_hits"] == 0);
      CHECK(std::abs(row["hits"].get<double>() - hits) <= 0.002 * hits);
    }
  }
  for (const Json& row : json["runs"]) {
    CAPTURE(row.dump());
    CHECK(row["characters"] == 300);
    CHECK(row["query_count"] == (row["queries"] == "rays" ? 1000 : 100));
    CHECK(row["rounds"] == 2);
    CHECK(row["seconds_least"] > 0);
    CHECK(row["seconds_least"] <= row["seconds_median"]);
    CHECK(row["seconds_median"] <= row["seconds_most"]);
    CHECK(row["seconds_query_median"] > 0);
    CHECK(outcome.out.find(row["setup"].get<std::string>() + ": ") != std::string::npos);
    if (is_of(row, "cab ")) {
      CHECK(row["misses"] == 0);
      CHECK(row["false_hits"] == 0);
      CHECK(row["differing"] == 0);  // on every instruction set
    }
  }
  const std::string csv = read_text(folder / "queries.csv");
  CHECK(static_cast<std::size_t>(std::count(csv.begin(), csv.end(), '\n')) == json["runs"].size() + 1);
}

TEST_CASE("cab peers --queries runs the set-ups of the libraries that it is told to") {
  const TemporaryFolder folder;
  const Outcome outcome = peers({"--queries", "--peers", "fcl", "--scene", "jitter", "--characters", "50", "--rays",
                                 "100", "--rounds", "1", "--isa", "scalar", "--json", folder / "queries.json"});
  INFO(outcome.error);
  REQUIRE(outcome.exit_code == 0);
  const Json json = Json::parse(read_text(folder / "queries.json"));
  Words names;
  for (const Json& row : json["runs"])
    names.push_back(row["queries"].get<std::string>() + ": " + row["setup"].get<std::string>());
  CHECK(names == Words{"rays: cab scalar", "rays: cab scalar, after a frame", "spheres: cab scalar",
                       "spheres: cab scalar, after a frame", "spheres: cab scalar, links",
                       "spheres: cab scalar, links, after a frame", "points: cab scalar",
                       "points: cab scalar, after a frame", "spheres: fcl own", "points: fcl own",
                       "spheres: fcl bounds", "spheres: fcl bounds, candidates", "points: fcl bounds"});
  for (const Json& best : json["best"]) CHECK(best["queries"] != "rays");  // FCL casts none
}

TEST_CASE("cab peers --past: no shot is lost or invented, and none depends on the others of its call") {
  const TemporaryFolder folder;
  const Outcome outcome =
      peers({"--past", "--rounds", "1", "--json", folder / "past.json", "--csv", folder / "past.csv"});
  INFO(outcome.error);
  REQUIRE(outcome.exit_code == 0);
  const Json runs = Json::parse(read_text(folder / "past.json"))["runs"];
  CHECK(runs.size() == 3);
  for (const Json& row : runs) {
    CAPTURE(row.dump());
    CHECK(row["judged"] >= 32);
    CHECK(row["hits"] >= row["judged"].get<double>() / 4);
    for (const char* wrong : {"misses", "false_hits", "inexact_hits", "not_inside", "differing_alone"})
      CHECK(row[wrong] == 0);
    CHECK(row["threshold_hits"] <= 2);
    for (const char* seconds : {"seconds_record", "seconds_shot", "seconds_tick"})
      CHECK(row[std::string(seconds) + "_least"] > 0);
  }
  const std::string csv = read_text(folder / "past.csv");
  CHECK(static_cast<std::size_t>(std::count(csv.begin(), csv.end(), '\n')) == runs.size() + 1);
}

TEST_CASE("cab peers says what was wrong and how to do it right") {
  const TemporaryFolder folder;
  struct Misuse {
    Words arguments;
    const char* told;
  };
  const std::vector<Misuse> misuses = {
      {{"--peers", "physx"}, "choose fcl, bullet, embree, ode"},
      {{"--peers", "fcl,"}, "choose fcl, bullet, embree, ode"},
      {{"--peers", "fcl,fcl"}, "given twice"},
      {{"--scene", "battle"}, "choose uniform, jitter, rigs, mixed"},
      {{"--characters", "0"}, "--characters"},
      {{"--characters", "1,many"}, "--characters"},
      {{"--rounds", "0"}, "--rounds"},
      {{"--leaves", "meshes"}, "boxes, shapes or both"},
      {{"--leaves", "boxes,boxes"}, "boxes, shapes or both"},
      {{"--isa", "mmx"}, "scalar"},
      {{"--queries", "--rays", "0"}, "--rays"},
      {{"--queries", "--peers", "ode"}, "ode answers no queries"},
      {{"--past", "--characters", "9"}, "--past"},
      {{"--json", folder / "x", "--csv", folder / "x"}, "same file"},
  };
  for (const Misuse& misuse : misuses) {
    std::string shown;
    for (const std::string& word : misuse.arguments) shown += " " + word;
    CAPTURE(shown);
    const Outcome outcome = peers(misuse.arguments);
    CAPTURE(outcome.error);
    CHECK(outcome.exit_code == 2);
    CHECK(outcome.out.empty());
    CHECK(outcome.error.find(misuse.told) != std::string::npos);
  }
}

}  // namespace cab::tests
