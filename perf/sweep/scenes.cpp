#include "perf/sweep/scenes.h"

#include <algorithm>
#include <filesystem>
#include <stdexcept>
#include <utility>

#include "perf/base/statistics.h"
#include "scenes/humanoid.h"
#include "scenes/registry.h"

namespace cab::perf {
namespace {

// Sizes that make one run of a scene a matter of milliseconds.
constexpr std::uint32_t kFrameCount = 1000;  // of the paper's scenes
constexpr std::uint32_t kCrowdFrames = 2;    // 1/30 s apart
constexpr std::uint32_t kDetailedCount = 100, kRopeCount = 16;
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
  WorldOptions options;
  for (const char* clip : kClips) {
    if (!std::filesystem::exists(clip))
      throw std::runtime_error(std::string("--scene cmu: there is no ") + clip + "; install assimp-testmodels");
    options.files.emplace_back(clip);
  }
  options.offsets = {{0, 0, 0}, kClipOffset};
  options.metres_per_unit = {kClipUnits};
  return of_frames("cmu", import_world(options), kClipFrames);
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

std::vector<SweepMember> sweep_family(const std::string& family) {
  std::vector<SweepMember> members;
  for (const SweepSceneName& scene : kSweepScenes) {
    const std::string name = scene.name;
    const std::size_t minus = name.find('-');
    if (minus != std::string::npos && name.substr(0, minus) == family)
      members.push_back({name, static_cast<std::uint32_t>(std::stoul(name.substr(minus + 1)))});
  }
  return members;
}

SweepScene make_sweep_scene(const std::string& name, std::uint32_t character_count) {
  if (const std::uint32_t table = paper_table(name); table > 0)
    return of_frames(name, scenes::make_paper_scene(table, kFrameCount), {0, kFrameCount});
  if (name == "cmu") return make_clips();
  const auto count_or = [character_count](std::uint32_t by_default) {
    return character_count > 0 ? character_count : by_default;
  };
  scenes::CrowdSources sources;
  for (const char* family : {"uniform", "spot", "giant", "far"})
    for (const SweepMember& member : sweep_family(family))
      if (name == member.name) return of_crowd(name, scenes::make_crowd(family, member.number));
  for (const SweepMember& member : sweep_family("detailed")) {
    if (name != member.name) continue;
    sources.boxes_per_link = member.number / scenes::kHumanoidLinks;
    return of_crowd(name, scenes::make_crowd("detailed", count_or(kDetailedCount), sources));
  }
  const std::pair<const char*, scenes::RopeShape> shapes[] = {{"ropes", scenes::RopeShape::kStraight},
                                                              {"wavy", scenes::RopeShape::kWavy},
                                                              {"coiled", scenes::RopeShape::kCoiled},
                                                              {"braided", scenes::RopeShape::kBraided}};
  for (const auto& [family, shape] : shapes)
    for (const SweepMember& member : sweep_family(family)) {
      if (name != member.name) continue;
      sources.ropes.link_count = member.number;
      sources.ropes.shape = shape;
      return of_crowd(name, scenes::make_crowd("ropes", count_or(kRopeCount), sources));
    }
  throw std::invalid_argument("make_sweep_scene: no scene is called " + name);
}

SweepScene make_files_scene(const WorldOptions& options) {
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

std::uint64_t SweepWorld::most_leaf_pairs() {
  if (crowd_) return run({}).candidates * scene_.most_leaves() * scene_.most_leaves();
  Policies policies;
  policies.strategy = Strategy::kBrute;
  return run(policies).box_tests;
}

}  // namespace cab::perf
