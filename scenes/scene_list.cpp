#include "scenes/scene_list.h"

#include "scenes/crowd/humanoid.h"
#include "scenes/import/captured_pair.h"
#include "scenes/paper/registry.h"

#include <algorithm>
#include <array>
#include <stdexcept>
#include <utility>

namespace cab::scenes {
namespace {

// The sizes of the scenes of `cab sweep`. With them one run of a scene takes milliseconds.
constexpr std::uint32_t kPaperFrames = 1000;
constexpr std::uint32_t kDetailedCount = 100, kRopeCount = 16;

constexpr NamedScene of_paper(const PaperScene& scene) {
  return {scene.name, scene.meaning, kSweepCommand | kSweepByDefault, FrameScene{scene.make, 0, kPaperFrames}};
}

// A humanoid has one box per link, and each becomes boxes_per_character / kHumanoidLinks boxes.
constexpr SizedCrowdScene of_boxes(std::uint32_t boxes_per_character) {
  return {make_detailed, kDetailedCount, true, boxes_per_character / kHumanoidLinks, {}, 0};
}

constexpr SizedCrowdScene of_links(std::uint32_t links_per_rope, RopeShape shape = RopeShape::kStraight) {
  return {make_ropes, kRopeCount, true, kDefaultBoxesPerLink, {links_per_rope, shape}, 0};
}

constexpr SizedCrowdScene of_characters(MakeCrowd make, std::uint32_t count) {
  return {make, count, false, kDefaultBoxesPerLink, {}, 0};
}

constexpr SizedCrowdScene of_rigs(std::uint32_t links_per_rig) {
  return {make_rigs, kDetailedCount, true, kDefaultBoxesPerLink, {}, links_per_rig};
}

constexpr std::array kRows = {
    of_paper(kPaperScenes[0]),
    of_paper(kPaperScenes[1]),
    of_paper(kPaperScenes[2]),
    of_paper(kPaperScenes[3]),
    of_paper(kPaperScenes[4]),
    NamedScene{"cmu", "two captured people who touch (Debian's package assimp-testmodels)",
               kSweepCommand | kSweepByDefault, FrameScene{make_captured_pair, kFirstCapturedFrame, kEndCapturedFrame}},

    NamedScene{"uniform", "humanoids at random places, 1 per square metre", kCrowdCommand | kPeersCommand,
               CrowdScene{make_uniform, ClipUse::kNone, false, 5.8, .1}},
    NamedScene{"jitter", "humanoids on a 1 m grid, each within 0.25 m", kCrowdCommand | kPeersCommand,
               CrowdScene{make_jitter, ClipUse::kNone, false, .22, .2}},
    NamedScene{"bottleneck", "recorded pedestrians, playing walking clips", kCrowdCommand,
               CrowdScene{make_bottleneck, ClipUse::kNeeded, true}},
    NamedScene{"battle", "clips at random places, 1.5 per square metre", kCrowdCommand,
               CrowdScene{make_battle, ClipUse::kNeeded}},
    NamedScene{"spot", "humanoids all in one spot", kCrowdCommand, CrowdScene{make_spot}},
    NamedScene{"line", "humanoids in one line, 0.5 m apart", kCrowdCommand, CrowdScene{make_line}},
    NamedScene{"churn", "uniform, one in a hundred replaced by another in every frame", kCrowdCommand,
               CrowdScene{make_churn}},
    NamedScene{"city", "uniform, nine in ten of them at rest", kCrowdCommand, CrowdScene{make_city}},
    NamedScene{"level", "uniform, with as many static boxes or triangles", kCrowdCommand, CrowdScene{make_level}},
    NamedScene{"giant", "uniform, one of them 100 times as large as the others", kCrowdCommand, CrowdScene{make_giant}},
    NamedScene{"detailed", "uniform, each link of each humanoid or clip in many boxes", kCrowdCommand,
               CrowdScene{make_detailed, ClipUse::kOptional}},
    NamedScene{"ropes", "long chains side by side, all slanting the same way", kCrowdCommand, CrowdScene{make_ropes}},
    NamedScene{"rigs", "uniform, each humanoid of many links with one box each", kCrowdCommand | kPeersCommand,
               CrowdScene{make_rigs}},
    NamedScene{"mixed", "humanoids of 20, 48 and 100 links, one in twenty four times as large",
               kCrowdCommand | kPeersCommand, CrowdScene{make_mixed}},
    NamedScene{"skins", "humanoids with skins on a 3 m grid, nobody near another", kCrowdCommand,
               CrowdScene{make_skins}},
    NamedScene{"far", "humanoids at random places of a square of 1e7 m", kCrowdCommand, CrowdScene{make_far}},

    NamedScene{"uniform-100", "100 humanoids at random places", kSweepCommand, of_characters(make_uniform, 100)},
    NamedScene{"uniform-1000", "1000 humanoids at random places", kSweepCommand | kSweepByDefault,
               of_characters(make_uniform, 1000)},
    NamedScene{"uniform-10000", "10000 humanoids at random places", kSweepCommand, of_characters(make_uniform, 10000)},
    NamedScene{"detailed-16", "100 humanoids of 16 boxes", kSweepCommand, of_boxes(16)},
    NamedScene{"detailed-32", "100 humanoids of 32 boxes", kSweepCommand, of_boxes(32)},
    NamedScene{"detailed-64", "100 humanoids of 64 boxes", kSweepCommand, of_boxes(64)},
    NamedScene{"detailed-128", "100 humanoids of 128 boxes", kSweepCommand, of_boxes(128)},
    NamedScene{"detailed-256", "100 humanoids of 256 boxes", kSweepCommand | kSweepByDefault, of_boxes(256)},
    NamedScene{"detailed-512", "100 humanoids of 512 boxes", kSweepCommand, of_boxes(512)},
    NamedScene{"detailed-1024", "100 humanoids of 1024 boxes", kSweepCommand, of_boxes(1024)},
    NamedScene{"rigs-32", "100 humanoids of 32 links", kSweepCommand, of_rigs(32)},
    NamedScene{"rigs-100", "100 humanoids of 100 links", kSweepCommand | kSweepByDefault, of_rigs(100)},
    NamedScene{"rigs-368", "100 humanoids of 368 links", kSweepCommand, of_rigs(368)},
    NamedScene{"mixed-300", "300 humanoids of 20, 48 and 100 links, one in twenty a giant", kSweepCommand,
               of_characters(make_mixed, 300)},
    NamedScene{"ropes-64", "16 straight ropes of 64 links that hardly touch", kSweepCommand | kSweepByDefault,
               of_links(64)},
    NamedScene{"ropes-128", "16 straight ropes of 128 links", kSweepCommand, of_links(128)},
    NamedScene{"ropes-256", "16 straight ropes of 256 links", kSweepCommand, of_links(256)},
    NamedScene{"ropes-512", "16 straight ropes of 512 links", kSweepCommand, of_links(512)},
    NamedScene{"ropes-1024", "16 straight ropes of 1024 links", kSweepCommand, of_links(1024)},
    NamedScene{"wavy-64", "16 waves of 64 links", kSweepCommand, of_links(64, RopeShape::kWavy)},
    NamedScene{"coiled-64", "16 springs of 64 links", kSweepCommand, of_links(64, RopeShape::kCoiled)},
    NamedScene{"braided-64", "16 ropes of 64 links in braids", kSweepCommand, of_links(64, RopeShape::kBraided)},
    NamedScene{"spot-30", "30 humanoids all in one spot", kSweepCommand, of_characters(make_spot, 30)},
    NamedScene{"giant-300", "300 humanoids, one of them 100 times as large", kSweepCommand,
               of_characters(make_giant, 300)},
    NamedScene{"far-300", "300 humanoids in a square of 1e7 m", kSweepCommand, of_characters(make_far, 300)},
};

}  // namespace

Span<const NamedScene> scene_list() { return kRows; }

const NamedScene* find_scene(SceneUse command, const std::string& name) {
  const auto row = std::find_if(kRows.begin(), kRows.end(),
                                [&](const NamedScene& scene) { return scene.is_for(command) && name == scene.name; });
  return row == kRows.end() ? nullptr : &*row;
}

std::string scene_names(SceneUse command, const char* separator) {
  std::string names;
  for (const NamedScene& scene : kRows)
    if (scene.is_for(command)) names += (names.empty() ? "" : separator) + std::string(scene.name);
  return names;
}

const CrowdScene& crowd_scene(const std::string& name) {
  const NamedScene* const scene = find_scene(kCrowdCommand, name);
  if (scene == nullptr)
    throw std::invalid_argument("no crowd scene is called '" + name + "'; choose " + scene_names(kCrowdCommand, ", "));
  return std::get<CrowdScene>(scene->source);
}

Crowd make_crowd(const std::string& name, std::uint32_t count, CrowdSources sources) {
  const CrowdScene& scene = crowd_scene(name);
  if (count == 0) throw std::invalid_argument("make_crowd: a crowd needs at least one character");
  if (scene.clips == ClipUse::kNeeded && sources.clips.empty())
    throw std::invalid_argument("make_crowd: " + name + " needs at least one clip");
  if (scene.needs_trajectories && sources.trajectories.tracks.empty())
    throw std::invalid_argument("make_crowd: " + name + " needs trajectories");
  return scene.make(count, std::move(sources));
}

Crowd make_sized_crowd(const SizedCrowdScene& scene, std::uint32_t count) {
  CrowdSources sources;
  sources.boxes_per_link = scene.boxes_per_link;
  sources.ropes = scene.ropes;
  sources.rig_links = scene.rig_links;
  return scene.make(scene.takes_count && count > 0 ? count : scene.character_count, std::move(sources));
}

}  // namespace cab::scenes
