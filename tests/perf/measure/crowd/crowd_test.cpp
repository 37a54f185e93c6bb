// `cab crowd` from outside: what it measures, writes and refuses.
#include <cab/cab.h>
#include <doctest/doctest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "tests/perf/cli/spawn.h"
#include "tests/perf/measure/crowd/sources.h"

namespace cab::tests {
namespace {

using Json = nlohmann::json;
using Words = std::vector<std::string>;

Outcome crowd(const Words& options) { return run_command("crowd", options); }

// Runs a small crowd and returns its JSON.
Json figures(const Words& options) {
  const TemporaryFolder folder;
  Words words = options;
  for (const char* word : {"--characters", "100", "--frames", "2", "--rounds", "1"}) words.emplace_back(word);
  words.insert(words.end(), {"--json", folder / "crowd.json"});
  const Outcome outcome = crowd(words);
  INFO(outcome.error);
  REQUIRE(outcome.exit_code == 0);
  return Json::parse(read_text(folder / "crowd.json"));
}

}  // namespace

TEST_CASE("cab crowd prints and writes times, memory, counts and the hash of the hits") {
  const TemporaryFolder folder;
  const Outcome outcome = crowd({"--scene", "uniform", "--characters", "2000", "--frames", "1", "--rounds", "2",
                                 "--json", folder / "crowd.json", "--csv", folder / "crowd.csv"});
  INFO(outcome.error);
  REQUIRE(outcome.exit_code == 0);
  const Json json = Json::parse(read_text(folder / "crowd.json"));
  CHECK(json["scene"] == "uniform");
  CHECK(json["characters"] == 2000);
  CHECK(json["frames"] == 1);
  CHECK(json["rounds"] == 2);
  CHECK(json["threads"] == 1);
  for (const PolicyField& field : policy_table())
    CHECK(json[field.name] == (std::string(field.name) == "strategy" ? "auto" : field.values[0].name));
  for (const char* phase :
       {"total_wall_seconds", "update_thread_seconds", "test_thread_seconds", "query_thread_seconds"}) {
    CAPTURE(std::string(phase));
    const double median = json[std::string(phase) + "_median"], least = json[std::string(phase) + "_least"],
                 most = json[std::string(phase) + "_most"];
    CHECK(least > 0);
    CHECK(least <= median);
    CHECK(median <= most);
  }
  const double ns = json["nanoseconds_per_character"], rate = json["characters_per_second"];
  CHECK(ns * rate == doctest::Approx(1e9));
  CHECK(ns == doctest::Approx(1e9 * json["total_wall_seconds_median"].get<double>() / 2000));
  CHECK(json["bytes_per_character"].get<double>() * 2000 == doctest::Approx(json["engine_bytes"].get<double>()));
  CHECK(json["bytes_per_character"] > 64.0 * 16);  // a leaf box is 64 bytes
  CHECK(json["hits"] == json["leaf_pairs"]);
  CHECK(json["box_tests"] > json["leaf_pairs"]);
  CHECK(json["hits_per_character"] == json["pairs_per_character"]);
  CHECK(json["expected_pairs_per_character"] == 5.8);
  CHECK(json["pairs_as_expected"] == true);
  CHECK(json["instances_masked"] == 0);
  const std::string hash = json["hits_hash"];
  CHECK(hash.size() == 16);
  for (const std::string& shown : {std::string("within 10 % of 5.8"), hash, std::string("characters per second"),
                                   std::string("2000 characters of 16 boxes, 1 frames, 2 rounds")}) {
    CAPTURE(shown);
    CHECK(outcome.out.find(shown) != std::string::npos);
  }

  std::istringstream csv(read_text(folder / "crowd.csv"));
  std::string header, line, more;
  CHECK(std::getline(csv, header));
  CHECK(std::getline(csv, line));
  CHECK(!std::getline(csv, more));
  CHECK(std::count(header.begin(), header.end(), ',') == std::count(line.begin(), line.end(), ','));
  CHECK(static_cast<std::size_t>(std::count(header.begin(), header.end(), ',')) + 1 == json.size());
  CHECK(line.find(hash) != std::string::npos);
}

TEST_CASE("cab crowd finds the same hits by every strategy, refit, instruction set and thread count") {
  const std::string expected = figures({"--scene", "uniform", "--strategy", "brute", "--isa", "scalar"})["hits_hash"];
  for (const PolicyField& field : policy_table())
    for (std::uint32_t v = 0; v < field.value_count; ++v) {
      const std::string name = field.name, value = field.values[v].name;
      // Other hits may come from an exact test, from refits that make leaf boxes larger, and from fewer axes.
      if (name == "exact" || value.rfind("aabb", 0) == 0 || name == "sat") continue;
      CAPTURE(name);
      CAPTURE(value);
      CHECK(figures({"--scene", "uniform", "--" + name, value})["hits_hash"] == expected);
    }
  for (std::uint8_t i = 0; i < kIsaCount; ++i) {
    const Isa isa = static_cast<Isa>(i);
    if (!isa_available(isa)) continue;
    CAPTURE(to_string(isa));
    CHECK(figures({"--scene", "uniform", "--isa", to_string(isa), "--threads", "2"})["hits_hash"] == expected);
  }
  CHECK(figures({"--scene", "jitter"})["hits_hash"] != expected);
}

TEST_CASE("cab crowd --in-contact finds the same characters by every strategy and thread count, and no hits") {
  const Json hits = figures({"--scene", "jitter"});
  CHECK(hits["report"] == "hits");
  CHECK(hits["in_contact"].is_null());
  const Json expected = figures({"--scene", "jitter", "--in-contact"});
  CHECK(expected["report"] == "in_contact");
  CHECK(expected["hits"] == 0);
  CHECK(expected["in_contact"] > 0);
  CHECK(expected["in_contact"] < 2 * 100);
  CHECK(expected["in_contact"] <= 2 * hits["hits"].get<int>());
  CHECK(expected["pairs_as_expected"].is_null());
  for (const char* strategy : {"tree", "rows", "brute"})
    for (const char* threads : {"1", "2"}) {
      CAPTURE(std::string(strategy));
      const Json json = figures({"--scene", "jitter", "--in-contact", "--strategy", strategy, "--threads", threads});
      CHECK(json["hits_hash"] == expected["hits_hash"]);
      CHECK(json["in_contact"] == expected["in_contact"]);
    }
}

TEST_CASE("cab crowd --spatial-order has the same hits, with the scene's numbers of its characters") {
  for (const char* scene : {"uniform", "line", "mixed"})
    for (const bool in_contact : {false, true}) {
      CAPTURE(std::string(scene));
      Words words = {"--scene", scene};
      if (in_contact) words.emplace_back("--in-contact");
      const Json given = figures(words);
      words.emplace_back("--spatial-order");
      const Json ordered = figures(words);
      CHECK(given["spatial_order"] == false);
      CHECK(ordered["spatial_order"] == true);
      CHECK(ordered["hits_hash"] == given["hits_hash"]);
      CHECK(ordered[in_contact ? "in_contact" : "hits"] == given[in_contact ? "in_contact" : "hits"]);
      CHECK(ordered[in_contact ? "in_contact" : "hits"] > 0);
    }
}

TEST_CASE("cab crowd plays clips, at random places or along recorded ways") {
  const Sources sources;
  const Words clips = {"--clip", sources.anna, "--clip", sources.bert};
  const Words battle = Words{"--scene", "battle"}, along = {"--scene", "bottleneck", "--trajectories", sources.ways};
  for (const Words& scene : {battle, along}) {
    CAPTURE(scene[1]);
    Words words = scene;
    words.insert(words.end(), clips.begin(), clips.end());
    const Json json = figures(words);
    CHECK(json["characters"] == 100);
    CHECK(json["hits"] > 0);
    CHECK(json["instances_masked"] == 0);
    CHECK(json["expected_pairs_per_character"].is_null());
    words.insert(words.end(), {"--strategy", "brute"});
    CHECK(figures(words)["hits_hash"] == json["hits_hash"]);
    // Half as tall, the figures have fewer hits.
    words.insert(words.end(), {"--units", "0.5", "--up", "y"});
    CHECK(figures(words)["hits"] < json["hits"]);
  }
}

TEST_CASE("cab crowd makes humanoids and clips of many boxes, and ropes") {
  const Sources sources;
  const Json plain = figures({"--scene", "uniform"});
  CHECK(plain["leaves"] == 16);
  CHECK(plain["boxes_per_link"].is_null());
  CHECK(plain["rope_shape"].is_null());
  CHECK(figures({"--scene", "detailed", "--boxes-per-link", "1"})["hits_hash"] == plain["hits_hash"]);
  const Json detailed = figures({"--scene", "detailed"});
  CHECK(detailed["links"] == 16);
  CHECK(detailed["leaves"] == 256);
  CHECK(detailed["boxes_per_link"] == 16);
  const Json brute = figures({"--scene", "detailed", "--strategy", "brute"});
  CHECK(brute["leaf_pairs"] > brute["hits"]);
  CHECK(brute["hits_hash"] == detailed["hits_hash"]);
  CHECK(detailed["hits"] < plain["hits"]);
  const Words clips = {"--scene", "detailed", "--clip", sources.anna, "--boxes-per-link", "4"};
  const Json played = figures(clips);
  CHECK(played["leaves"] == 4 * played["links"].get<int>());
  CHECK(played["hits"] > 0);
  const Json ropes = figures({"--scene", "ropes"});
  CHECK(ropes["leaves"] == 64);
  CHECK(ropes["rope_shape"] == "straight");
  CHECK(ropes["rope_spacing"] == 1.5);
  CHECK(ropes["hits"] > 0);
  const Json braids = figures({"--scene", "ropes", "--links", "20", "--shape", "braided", "--spacing", "3"});
  CHECK(braids["leaves"] == 20);
  CHECK(braids["rope_shape"] == "braided");
  CHECK(braids["hits"] == 0);
}

TEST_CASE("cab crowd makes bodies of many links, and several kinds of bodies") {
  const Json plain = figures({"--scene", "uniform"}), least = figures({"--scene", "rigs", "--links", "16"});
  CHECK(least["links"] == 16);
  CHECK(least["hits_hash"] == plain["hits_hash"]);
  const Json rigs = figures({"--scene", "rigs"});
  CHECK(rigs["links"] == 100);
  CHECK(rigs["leaves"] == 100);
  CHECK(rigs["hits"] > plain["hits"]);
  const Json mixed = figures({"--scene", "mixed"});
  CHECK(mixed["links"] == 100);
  CHECK(mixed["hits_hash"] == figures({"--scene", "mixed", "--strategy", "brute"})["hits_hash"]);
}

TEST_CASE("cab crowd --scene skins has as many leaves, grown or rigid, and nobody touches") {
  for (const std::string leaves : {"grown", "rigid"}) {
    const Json skins = figures({"--scene", "skins", "--skin-leaves", leaves});
    CHECK(skins["links"] == 16);
    CHECK(skins["leaves"] == 44);
    CHECK(skins["hits"] == 0);
  }
  CHECK(figures({"--scene", "skins", "--exact", "surface"})["hits"] == 0);
}

TEST_CASE("cab crowd --scene level has static boxes or triangles among the crowd of `uniform`") {
  const Json plain = figures({"--scene", "uniform"});
  std::set<std::string> hashes = {plain["hits_hash"]};
  for (const char* kind : {"boxes", "triangles"}) {
    CAPTURE(std::string(kind));
    const Json level = figures({"--scene", "level", "--level", kind});
    CHECK(level["hits"] > plain["hits"]);
    CHECK(level["instances_resting"] >= 100);
    CHECK(hashes.insert(level["hits_hash"]).second);
    for (const char* word : {"--spatial-order", "--in-contact"}) {
      const Json other = figures({"--scene", "level", "--level", kind, word});
      CHECK((other["hits_hash"] == level["hits_hash"]) == (std::string(word) == "--spatial-order"));
    }
    CHECK(figures({"--scene", "level", "--level", kind, "--strategy", "brute"})["hits_hash"] == level["hits_hash"]);
    CHECK(figures({"--scene", "level", "--level", kind, "--threads", "2"})["hits_hash"] == level["hits_hash"]);
  }
  CHECK(figures({"--scene", "level"})["hits_hash"] == figures({"--scene", "level", "--level", "boxes"})["hits_hash"]);
}

TEST_CASE("cab crowd --sweep finds what may have touched since the frame before, and all that touches now") {
  const Json plain = figures({"--scene", "uniform"}), swept = figures({"--scene", "uniform", "--sweep"});
  CHECK(plain["sweep"] == false);
  CHECK(swept["sweep"] == true);
  CHECK(swept["hits"] > plain["hits"]);
  CHECK(swept["hits_hash"] == figures({"--scene", "uniform", "--sweep", "--threads", "2"})["hits_hash"]);
}

TEST_CASE("cab crowd --coarse puts characters at a coarser level, in which no pair of characters is lost") {
  const Json finest = figures({"--scene", "uniform"});
  for (const char* kind : {"reach", "nodes"})
    for (const char* leaves : {"1", "6"}) {
      CAPTURE(kind);
      CAPTURE(leaves);
      const Words options = {"--scene", "uniform", "--lod", kind, "--lod-leaves", leaves, "--coarse", "0.8"};
      const Json mixed = figures(options);
      CHECK(mixed["coarse"] == 0.8);
      CHECK(mixed["lod"] == kind);
      CHECK(mixed["character_pairs"].get<int>() > finest["character_pairs"].get<int>());
      CHECK(mixed["instances_masked"] == 0);
      Words threads = options;
      threads.insert(threads.end(), {"--threads", "2"});
      CHECK(figures(threads)["hits_hash"] == mixed["hits_hash"]);
    }
  CHECK(figures({"--scene", "uniform", "--coarse", "0"})["hits_hash"] == finest["hits_hash"]);
}

TEST_CASE("cab crowd --area spreads the crowd, and fewer touch") {
  const Json dense = figures({"--scene", "uniform"}), sparse = figures({"--scene", "uniform", "--area", "9"});
  CHECK(figures({"--scene", "uniform", "--area", "1"})["hits_hash"] == dense["hits_hash"]);
  CHECK(sparse["area_per_character"] == 9);
  CHECK(2 * sparse["hits"].get<int>() < dense["hits"].get<int>());
}

TEST_CASE("cab crowd says what was wrong and how to do it right") {
  const Sources sources;
  const TemporaryFolder folder;
  struct Misuse {
    Words arguments;
    const char* told;
  };
  const std::vector<Misuse> misuses = {
      {{}, "--scene"},
      {{"--scene", "party"}, "choose uniform, jitter, bottleneck, battle"},
      {{"--scene", "uniform", "--level", "boxes"}, "--level is for --scene level"},
      {{"--scene", "churn", "--area", "4"}, "--area is for --scene uniform and --scene rigs"},
      {{"--scene", "uniform", "--area", "0"}, "--area"},
      {{"--scene", "uniform", "--coarse", "2"}, "--coarse"},
      {{"--scene", "uniform", "--coarse", "0.5", "--lod", "blobs"}, "choose reach, nodes"},
      {{"--scene", "uniform", "--lod", "nodes"}, "--lod requires --coarse"},
      {{"--scene", "uniform", "--lod-leaves", "3"}, "--lod-leaves requires --coarse"},
      {{"--scene", "uniform", "--coarse", "0.5", "--sweep"}, "--coarse has no figures with"},
      {{"--scene", "uniform", "--coarse", "0.5", "--lod-leaves", "0"}, "--lod-leaves"},
      {{"--scene", "level", "--level", "sand"}, "choose boxes, triangles"},
      {{"--scene", "uniform", "--at-rest", "reported"}, "--at-rest is for --scene city"},
      {{"--scene", "city", "--at-rest", "asleep"}, "choose moved, reported, skipped"},
      {{"--scene", "uniform", "--characters", "0"}, "--characters"},
      {{"--scene", "uniform", "--characters", "many"}, "--characters"},
      {{"--scene", "uniform", "--frames", "0"}, "--frames"},
      {{"--scene", "uniform", "--rounds", "0"}, "--rounds"},
      {{"--scene", "uniform", "--strategy", "fast"}, "choose tree"},
      {{"--scene", "uniform", "--isa", "mmx"}, "scalar"},
      {{"--scene", "uniform", "--threads", "-1"}, "--threads"},
      {{"--scene", "uniform", "--clip", sources.anna}, "--clip, --units and --up are not for --scene uniform"},
      {{"--scene", "jitter", "--trajectories", sources.ways}, "--trajectories is not for --scene jitter"},
      {{"--scene", "battle"}, "--scene battle needs --clip FILE"},
      {{"--scene", "uniform", "--skin-leaves", "rigid"}, "--skin-leaves is for --scene skins, not for uniform"},
      {{"--scene", "skins", "--skin-leaves", "soft"}, "choose grown, rigid"},
      {{"--scene", "uniform", "--boxes-per-link", "16"}, "--boxes-per-link is for --scene detailed, not for uniform"},
      {{"--scene", "detailed", "--boxes-per-link", "5"}, "choose 1, 2, 4, 8, 16, 32, 64"},
      {{"--scene", "detailed", "--up", "y"}, "add --clip FILE"},
      {{"--scene", "jitter", "--spacing", "2"}, "--shape and --spacing are for --scene ropes, not for jitter"},
      {{"--scene", "jitter", "--links", "20"}, "--links is for --scene ropes and --scene rigs, not for jitter"},
      {{"--scene", "rigs", "--links", "15"}, "a body of --scene rigs has at least 16"},
      {{"--scene", "ropes", "--shape", "knotted"}, "choose straight, wavy, coiled, braided"},
      {{"--scene", "ropes", "--links", "1"}, "--links"},
      {{"--scene", "ropes", "--spacing", "0"}, "--spacing"},
      {{"--scene", "ropes", "--clip", sources.anna}, "are not for --scene ropes"},
      {{"--scene", "bottleneck", "--clip", sources.anna}, "--scene bottleneck needs --trajectories FILE"},
      {{"--scene", "battle", "--clip", sources.anna, "--fps", "25"}, "--fps is for --trajectories"},
      {{"--scene", "bottleneck", "--clip", sources.anna, "--trajectories", sources.ways, "--fps", "0"}, "--fps"},
      {{"--scene", "battle", "--clip", sources.anna, "--units", "1", "--units", "1"}, "2 times for 1 clips"},
      {{"--scene", "battle", "--clip", sources.anna, "--json", sources.anna}, "is an input"},
      {{"--scene", "uniform", "--json", folder / "x", "--csv", folder / "x"}, "same file"},
  };
  const std::string before = read_text(sources.anna);
  for (const Misuse& misuse : misuses) {
    std::string shown;
    for (const std::string& word : misuse.arguments) shown += " " + word;
    CAPTURE(shown);
    const Outcome outcome = crowd(misuse.arguments);
    CAPTURE(outcome.error);
    CHECK(outcome.exit_code == 2);
    CHECK(outcome.out.empty());
    CHECK(outcome.error.find(misuse.told) != std::string::npos);
  }
  CHECK(read_text(sources.anna) == before);

  const Outcome missing = crowd({"--scene", "battle", "--clip", folder / "none.bvh"});
  CHECK(missing.exit_code == 1);
  CHECK(missing.error.find("none.bvh: no such file") != std::string::npos);
  write_text(folder / "ways.txt", "# framerate: 25 fps\n1 0 1\n");
  const Outcome bad = crowd({"--scene", "bottleneck", "--clip", sources.anna, "--trajectories", folder / "ways.txt"});
  CHECK(bad.exit_code == 1);
  CHECK(bad.error.find("ways.txt:2: ") != std::string::npos);

  const std::string help = crowd({"--help"}).out;
  for (const char* part : {"id, frame, x and y", "# framerate: N fps", "--fps N", "obsmat"}) {
    CAPTURE(part);
    CHECK(help.find(part) != std::string::npos);
  }
  write_text(folder / "ways.txt", "1 0 1 1\n1 1 1 1\n");
  Words walk = {"--scene",      "bottleneck", "--clip",   sources.anna, "--trajectories", folder / "ways.txt",
                "--characters", "2",          "--frames", "1",          "--rounds",       "1"};
  CHECK(crowd(walk).error.find("ways.txt: no frame rate: give --fps") != std::string::npos);
  walk.insert(walk.end(), {"--fps", "2.5"});
  const Outcome timed = crowd(walk);
  CHECK(timed.exit_code == 0);
  CHECK(timed.error.find("ways.txt: no header: columns are read as id frame x y") != std::string::npos);
}

}  // namespace cab::tests
