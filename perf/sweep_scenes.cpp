#include "perf/sweep_scenes.h"

#include <algorithm>
#include <filesystem>
#include <stdexcept>
#include <utility>

#include "perf/run_world.h"
#include "scenes/detailed.h"
#include "scenes/humanoid.h"
#include "scenes/registry.h"

namespace cab::perf {
namespace {

// Sizes that make one run of a scene a matter of milliseconds.
constexpr std::uint32_t kFrames = 1000;    // of the paper's scenes
constexpr std::uint32_t kCrowdFrames = 2;  // 1/30 s apart
constexpr std::uint32_t kUniformCount = 1000, kRopeCount = 60;
constexpr std::uint32_t kDetailedBoxes = 25600;  // of all characters, but no fewer than kLeastDetailed of these
constexpr std::uint32_t kLeastDetailed = 60;
constexpr double kCrowdFramesPerSecond = 30;

// The clips of `./dev demo`, placed as it does, and the frames in which they are near each other.
constexpr const char* kClips[] = {"/usr/share/assimp/models/BVH/01_01.bvh", "/usr/share/assimp/models/BVH/01_03.bvh"};
constexpr double kClipUnits = .0564;
constexpr std::array<double, 3> kClipOffset = {1.3, 0, .4};
constexpr FrameRange kClipFrames = {1600, 2600};

// Poses of a figure that boxes are compared on.
constexpr std::uint32_t kSampledPoses = 24;

SweepScene of_frames(std::string name, scenes::Scene scene, FrameRange frames) {
  SweepScene out;
  out.name = std::move(name);
  out.frames = frames;
  out.frame_count = frames.count();
  out.scene = std::make_shared<const scenes::Scene>(std::move(scene));
  return out;
}

SweepScene of_crowd(std::string name, scenes::Crowd crowd) {
  SweepScene out;
  out.name = std::move(name);
  out.frame_count = kCrowdFrames;
  out.posed.resize(kCrowdFrames);
  for (std::uint32_t f = 0; f < kCrowdFrames; ++f) scenes::pose_crowd(crowd, f / kCrowdFramesPerSecond, out.posed[f]);
  out.crowd = std::make_shared<const scenes::Crowd>(std::move(crowd));
  return out;
}

SweepScene make_clips() {
  RunOptions options;
  for (const char* clip : kClips) {
    if (!std::filesystem::exists(clip))
      throw std::runtime_error(std::string("--scene cmu: there is no ") + clip + "; install assimp-testmodels");
    options.files.emplace_back(clip);
  }
  options.offsets = {{0, 0, 0}, kClipOffset};
  options.metres_per_unit = {kClipUnits};
  return of_frames("cmu", import_world(options), kClipFrames);
}

// ropes, ropes-256, ropes-1024, ropes-wavy and so on.
SweepScene make_ropes(const std::string& name, std::uint32_t character_count) {
  scenes::CrowdSources sources;
  for (std::size_t s = 0; s < scenes::kRopeShapeNames.size(); ++s)
    if (name == std::string("ropes-") + scenes::kRopeShapeNames[s])
      sources.ropes.shape = static_cast<scenes::RopeShape>(s);
  for (const std::uint32_t links : {256u, 1024u})
    if (name == "ropes-" + std::to_string(links)) sources.ropes.link_count = links;
  return of_crowd(name, scenes::make_crowd("ropes", character_count > 0 ? character_count : kRopeCount, sources));
}

std::uint32_t paper_table(const std::string& name) {
  for (const scenes::PaperScene& paper : scenes::kPaperScenes)
    if (name == paper.name) return paper.table;
  return 0;
}

}  // namespace

std::uint32_t SweepScene::character_count() const {
  return crowd ? crowd->count() : static_cast<std::uint32_t>(scene->characters.size());
}

std::size_t SweepScene::most_leaves() const {
  std::size_t most = 0;
  if (scene)
    for (const scenes::Character& character : scene->characters) most = std::max(most, character.leaves.size());
  if (crowd)
    for (const scenes::CrowdGroup& group : crowd->groups) most = std::max(most, group.figure.leaves.size());
  return most;
}

SweepScene make_detailed(std::uint32_t leaf_count, std::uint32_t character_count) {
  scenes::CrowdSources sources;
  sources.boxes_per_link = leaf_count / scenes::kHumanoidLinks;
  if (character_count == 0) character_count = std::max(kLeastDetailed, kDetailedBoxes / leaf_count);
  return of_crowd("detailed-" + std::to_string(leaf_count),
                  scenes::make_crowd("detailed", character_count, std::move(sources)));
}

SweepScene make_sweep_scene(const std::string& name, std::uint32_t character_count) {
  if (const std::uint32_t table = paper_table(name); table > 0)
    return of_frames(name, scenes::make_paper_scene(table, kFrames), {0, kFrames});
  if (name == "cmu") return make_clips();
  if (name == "uniform")
    return of_crowd(name, scenes::make_crowd(name, character_count > 0 ? character_count : kUniformCount));
  for (const std::uint32_t leaves : {64u, 256u, 1024u})
    if (name == "detailed-" + std::to_string(leaves)) return make_detailed(leaves, character_count);
  return make_ropes(name, character_count);
}

SweepScene make_files_scene(const RunOptions& options) {
  scenes::Scene scene = import_world(options);
  const FrameRange frames = {0, scene.frame_count};
  return of_frames("files", std::move(scene), frames);
}

std::vector<PosedFigure> sample_figures(const SweepScene& scene) {
  std::vector<PosedFigure> figures;
  const auto add = [&figures](const scenes::Character& character, std::size_t pose_count, std::size_t first,
                              const std::vector<float>& poses, const std::vector<float>& orientations) {
    PosedFigure posed;
    posed.figure = character;
    posed.figure.poses.clear();
    posed.figure.origins.clear();
    posed.figure.rest_frame.reset();
    posed.pose_count = static_cast<std::uint32_t>(std::min<std::size_t>(kSampledPoses, pose_count));
    const std::size_t floats = character.link_parents.size() * scenes::pose_floats(character.pose_format);
    for (std::size_t p = 0; p < posed.pose_count; ++p) {
      const std::size_t at = first + p * pose_count / posed.pose_count;
      const auto pose = poses.begin() + static_cast<std::ptrdiff_t>(at * floats);
      posed.figure.poses.insert(posed.figure.poses.end(), pose, pose + static_cast<std::ptrdiff_t>(floats));
      if (orientations.empty()) continue;
      const auto turn = orientations.begin() + static_cast<std::ptrdiff_t>(at * 4);
      posed.orientations.insert(posed.orientations.end(), turn, turn + 4);
    }
    figures.push_back(std::move(posed));
  };
  if (scene.scene)
    for (const scenes::Character& character : scene.scene->characters)
      add(character, character.is_static ? 1 : scene.frames.count(), character.is_static ? 0 : scene.frames.first,
          character.poses, {});
  if (scene.crowd)
    for (std::size_t g = 0; g < scene.crowd->groups.size(); ++g)
      add(scene.crowd->groups[g].figure, scene.crowd->groups[g].count, 0, scene.posed[0][g].poses,
          scene.posed[0][g].orientations);
  return figures;
}

SweepWorld::SweepWorld(const SweepScene& scene, Isa isa, std::uint32_t thread_count) : scene_(scene) {
  if (scene.crowd)
    crowd_ = std::make_unique<CrowdSession>(*scene.crowd, isa, thread_count);
  else
    frames_ = std::make_unique<EngineSession>(*scene.scene, SessionOptions{isa, thread_count, scene.frames});
}

Isa SweepWorld::isa() const { return crowd_ ? crowd_->isa() : frames_->isa(); }
std::uint32_t SweepWorld::thread_count() const { return crowd_ ? crowd_->thread_count() : frames_->thread_count(); }

FrameStats SweepWorld::run(const Policies& policies, std::vector<SweepHit>* hits) {
  FrameStats sum;
  if (hits) hits->clear();
  if (crowd_) {
    for (std::uint32_t f = 0; f < scene_.frame_count; ++f) {
      add_stats(sum, crowd_->run(scene_.posed[f], policies));
      if (!hits) continue;
      for (const Hit& hit : crowd_->hits())
        hits->push_back(
            {f, hit.batch_a.value, hit.instance_a, hit.link_a, hit.batch_b.value, hit.instance_b, hit.link_b});
    }
  } else {
    sum = frames_->run(policies, false, [hits](const BlockResult& block) {
      if (!hits) return;
      for (const Touch& touch : block.touches)
        hits->push_back({touch.frame, touch.character_a, 0, touch.link_a, touch.character_b, 0, touch.link_b});
    });
  }
  if (hits) std::sort(hits->begin(), hits->end());
  return sum;
}

void SweepWorld::warm(const Policies& policies) {
  if (crowd_) {
    crowd_->run(scene_.posed[0], policies);
  } else {
    BlockResult result;
    frames_->run_block(0, policies, false, result);
  }
}

}  // namespace cab::perf
