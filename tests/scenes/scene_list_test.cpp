// The list of scenes: every name makes the scene that it says and no other, and a name that is not in the list is an
// error.
#include "scenes/scene_list.h"

#include "layout/bit_hash.h"
#include "scenes/paper/registry.h"
#include "tests/scenes/crowd/made_crowds.h"

#include <doctest/doctest.h>

#include <filesystem>
#include <map>
#include <set>
#include <stdexcept>
#include <string>

namespace cab::tests {
namespace {

using scenes::Crowd;
using scenes::CrowdScene;
using scenes::FrameScene;
using scenes::kCrowdCommand;
using scenes::kPeersCommand;
using scenes::kSweepByDefault;
using scenes::kSweepCommand;
using scenes::NamedScene;
using scenes::SizedCrowdScene;

// All sources that any crowd scene needs.
scenes::CrowdSources sources() {
  scenes::CrowdSources sources;
  sources.clips.push_back(walking_stick());
  sources.trajectories.tracks = {straight_track(0, 0, 0), straight_track(0, 5, 0)};
  return sources;
}

// A hash of every figure's leaf boxes and of all poses at time 1 s.
std::uint64_t fingerprint(const Crowd& crowd) {
  cab::BitHash hash;
  for (const scenes::CrowdGroup& group : crowd.groups)
    for (const scenes::BodyLeaf& leaf : group.figure.leaves) hash.add(leaf.box);
  for (const StaticBody& body : crowd.level.bodies) hash.add(body.box);
  hash.add(pose_hash(posed_at(crowd, 1)));
  return hash.value();
}

// The number after the minus of a name, and what stands before it.
struct SizedName {
  std::string family;
  std::uint32_t number;
};
SizedName read_name(const std::string& name) {
  const std::size_t minus = name.find('-');
  REQUIRE(minus != std::string::npos);
  return {name.substr(0, minus), static_cast<std::uint32_t>(std::stoul(name.substr(minus + 1)))};
}

// What the exception says that make() throws.
template <class Make>
std::string refusal(Make&& make) {
  try {
    make();
  } catch (const std::invalid_argument& error) { return error.what(); }
  return "";
}

}  // namespace

TEST_CASE("every scene stands in the list once, and the commands offer what they are for") {
  std::set<std::string> names;
  for (const NamedScene& scene : scenes::scene_list()) {
    CAPTURE(std::string(scene.name));
    CHECK(names.insert(scene.name).second);
    CHECK(std::string(scene.meaning) != "");
    CHECK((scene.is_for(kCrowdCommand) || scene.is_for(kSweepCommand)));
    CHECK(scene.is_for(kCrowdCommand) == std::holds_alternative<CrowdScene>(scene.source));
    CHECK(scene.is_for(kSweepCommand) != scene.is_for(kCrowdCommand));
    if (scene.is_for(kSweepByDefault)) CHECK(scene.is_for(kSweepCommand));
    // `cab peers` makes its crowds without clips and trajectories.
    if (!scene.is_for(kPeersCommand)) continue;
    REQUIRE(scene.is_for(kCrowdCommand));
    CHECK(std::get<CrowdScene>(scene.source).clips != scenes::ClipUse::kNeeded);
    CHECK(!std::get<CrowdScene>(scene.source).needs_trajectories);
  }
  CHECK(scenes::scene_names(kCrowdCommand, "|") ==
        "uniform|jitter|bottleneck|battle|spot|line|churn|city|level|giant|detailed|ropes|rigs|mixed|skins|far");
  CHECK(scenes::scene_names(kPeersCommand, ", ") == "uniform, jitter, rigs, mixed");
  CHECK(scenes::scene_names(kSweepByDefault, " ") ==
        "chains3 chains6 dented braid hand cmu uniform-1000 detailed-256 rigs-100 ropes-64");
}

TEST_CASE("every crowd name makes its own crowd") {
  std::map<std::uint64_t, std::string> found;  // names by fingerprint
  for (const NamedScene& scene : scenes::scene_list()) {
    if (!scene.is_for(kCrowdCommand)) continue;
    CAPTURE(std::string(scene.name));
    const bool needs_clips = std::get<CrowdScene>(scene.source).clips == scenes::ClipUse::kNeeded;
    const Crowd crowd = scenes::make_crowd(scene.name, 20, needs_clips ? sources() : scenes::CrowdSources());
    CHECK(crowd.count() == 20);
    const auto row = found.emplace(fingerprint(crowd), scene.name);
    CAPTURE(row.first->second);
    CHECK(row.second);
  }
}

TEST_CASE("a crowd of `cab sweep` has the size that its name says") {
  std::map<std::uint64_t, std::string> found;  // names by fingerprint
  for (const NamedScene& scene : scenes::scene_list()) {
    const auto* const sized = std::get_if<SizedCrowdScene>(&scene.source);
    if (sized == nullptr) continue;
    const std::string name = scene.name;
    CAPTURE(name);
    const auto [family, number] = read_name(name);
    const Crowd crowd = scenes::make_sized_crowd(*sized, 0), three = scenes::make_sized_crowd(*sized, 3);
    const scenes::Character& figure = crowd.groups.front().figure;
    if (family == "detailed") {
      CHECK(figure.leaves.size() == number);
      CHECK(crowd.count() == 100);
      CHECK(three.count() == 3);
    } else if (family == "rigs") {
      CHECK(figure.link_parents.size() == number);
      CHECK(figure.leaves.size() == number);
      CHECK(crowd.count() == 100);
      CHECK(three.count() == 3);
    } else if (family == "ropes" || family == "wavy" || family == "coiled" || family == "braided") {
      CHECK(figure.link_parents.size() == number);
      CHECK(crowd.count() == 16);
      CHECK(three.count() == 3);
    } else {
      CHECK(crowd.count() == number);
      CHECK(three.count() == number);
    }
    const auto row = found.emplace(fingerprint(crowd), name);
    CAPTURE(row.first->second);
    // 100 humanoids of 16 boxes are those of uniform-100.
    CHECK(row.second == (name != "detailed-16"));
  }
}

TEST_CASE("the paper's scenes stand in the list in the order of its tables") {
  std::size_t table = 0;
  for (const NamedScene& scene : scenes::scene_list()) {
    const auto* const frames = std::get_if<FrameScene>(&scene.source);
    if (frames == nullptr || std::string(scene.name) == "cmu") continue;
    REQUIRE(table < scenes::kPaperScenes.size());
    const scenes::PaperScene& paper = scenes::kPaperScenes[table++];
    CAPTURE(paper.table);
    CHECK(std::string(scene.name) == paper.name);
    CHECK(frames->first_frame == 0);
    const scenes::Scene made = frames->make(20), expected = scenes::make_paper_scene(paper.table, 20);
    CHECK(made.name == paper.name);
    CHECK(pose_hash(made) == pose_hash(expected));
    CHECK(shape_hash(made) == shape_hash(expected));
  }
  CHECK(table == scenes::kPaperScenes.size());
}

TEST_CASE("hashes of a scene tell other poses and other shapes apart") {
  const scenes::Scene scene = scenes::make_paper_scene(1, 20);
  const auto hashes_after = [&](auto&& change) {
    scenes::Scene other = scene;
    change(other.characters[1]);
    return std::pair(pose_hash(other) != pose_hash(scene), shape_hash(other) != shape_hash(scene));
  };
  using Character = scenes::Character;
  CHECK(hashes_after([](Character&) {}) == std::pair(false, false));
  CHECK(hashes_after([](Character& one) { one.poses.back() += 1; }) == std::pair(true, false));
  CHECK(hashes_after([](Character& one) { one.leaves.back().link -= 1; }) == std::pair(false, true));
  CHECK(hashes_after([](Character& one) { one.leaves.back().box.half[2] += 1; }) == std::pair(false, true));
}

TEST_CASE("cmu has the frames that `cab sweep` runs, or says which file is missing") {
  const NamedScene* const scene = scenes::find_scene(kSweepCommand, "cmu");
  REQUIRE(scene != nullptr);
  const FrameScene& frames = std::get<FrameScene>(scene->source);
  CHECK(frames.first_frame < frames.end_frame);
  if (std::filesystem::exists("/usr/share/assimp/models/BVH/01_01.bvh")) {
    const scenes::Scene made = frames.make(frames.end_frame);
    CHECK(made.characters.size() == 2);
    CHECK(made.frame_count >= frames.end_frame);
  } else {
    CHECK_THROWS_WITH_AS(frames.make(frames.end_frame), doctest::Contains("install assimp-testmodels"),
                         std::runtime_error);
  }
}

TEST_CASE("a name that is not in the list is an error that lists the names") {
  CHECK(scenes::find_scene(kCrowdCommand, "party") == nullptr);
  CHECK(scenes::find_scene(kCrowdCommand, "") == nullptr);
  CHECK(scenes::find_scene(kPeersCommand, "battle") == nullptr);
  CHECK(scenes::find_scene(kSweepCommand, "uniform") == nullptr);
  REQUIRE(scenes::find_scene(kSweepCommand, "uniform-100") != nullptr);
  CHECK(std::string(scenes::find_scene(kSweepCommand, "uniform-100")->name) == "uniform-100");
  for (const std::string name : {"party", "", "uniform-100", "chains3", "Uniform"}) {
    CAPTURE(name);
    const std::string text = refusal([&] { scenes::make_crowd(name, 10, sources()); });
    CHECK(text ==
          "no crowd scene is called '" + name +
              "'; choose uniform, jitter, bottleneck, battle, spot, line, churn, city, level, giant, detailed, ropes, "
              "rigs, mixed, skins, far");
    CHECK(refusal([&] { scenes::crowd_scene(name); }) == text);
  }
}

}  // namespace cab::tests
