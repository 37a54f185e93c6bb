#include "perf/measure/sweep/scenes.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "perf/base/statistics.h"
#include "scenes/scene_list.h"

namespace cab::perf {
namespace {

// The frames of a crowd: so few that one run takes milliseconds.
constexpr std::uint32_t kCrowdFrames = 2;  // 1/30 s apart
constexpr double kCrowdFramesPerSecond = 30;

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

SweepScene make_sweep_scene(const std::string& name, std::uint32_t character_count) {
  const scenes::NamedScene* const row = scenes::find_scene(scenes::kSweepCommand, name);
  if (row == nullptr) throw std::invalid_argument("make_sweep_scene: no scene is called " + name);
  if (const auto* frames = std::get_if<scenes::FrameScene>(&row->source))
    return of_frames(name, frames->make(frames->end_frame), {frames->first_frame, frames->end_frame});
  return of_crowd(name, scenes::make_sized_crowd(std::get<scenes::SizedCrowdScene>(row->source), character_count));
}

SweepScene make_files_scene(const WorldOptions& options) {
  scenes::Scene scene = import_world(options);
  const FrameRange frames = {0, scene.frame_count};
  return of_frames("files", std::move(scene), frames);
}

SweepWorld::SweepWorld(const SweepScene& scene, Isa isa, std::uint32_t thread_count) : scene_(scene) {
  if (scene.crowd)
    crowd_ = std::make_unique<CrowdSession>(*scene.crowd, isa, thread_count);
  else
    frames_ = std::make_unique<EngineSession>(*scene.scene, SessionOptions{isa, thread_count, scene.frames});
}

Isa SweepWorld::isa() const { return crowd_ ? crowd_->isa() : frames_->isa(); }
std::uint32_t SweepWorld::thread_count() const { return crowd_ ? crowd_->thread_count() : frames_->thread_count(); }

FrameStats SweepWorld::run(const Policies& policies, std::vector<SweepHit>* hits, RunFrame frame) {
  FrameStats sum;
  if (hits) hits->clear();
  if (crowd_) {
    for (std::uint32_t f = 0; f < scene_.frame_count; ++f) {
      add_stats(sum, crowd_->run(scene_.posed[f], policies, false, frame));
      if (!hits) continue;
      for (const Hit& hit : crowd_->hits())
        hits->push_back(
            {f, hit.batch_a.value, hit.instance_a, hit.link_a, hit.batch_b.value, hit.instance_b, hit.link_b});
    }
  } else {
    const auto add = [hits](const BlockResult& block) {
      if (!hits) return;
      for (const Touch& touch : block.touches)
        hits->push_back({touch.frame, touch.character_a, 0, touch.link_a, touch.character_b, 0, touch.link_b});
    };
    sum = frames_->run(policies, false, add, frame);
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
