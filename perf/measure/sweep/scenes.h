// The scenes of `cab sweep`: frames of a few characters or crowds, with one interface for both.
#pragma once

#include <cab/cab.h>

#include <compare>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "perf/base/crowd_session.h"
#include "perf/base/engine_session.h"
#include "perf/tools/run/run_world.h"
#include "scenes/crowd/crowd.h"
#include "scenes/scene.h"

namespace cab::perf {

// A scene in memory: frames of a few characters, or a crowd with its poses.
struct SweepScene {
  std::string name;
  std::uint32_t frame_count = 0;
  FrameRange frames;                           // of `scene`
  std::shared_ptr<const scenes::Scene> scene;  // null if `crowd` is set
  std::shared_ptr<const scenes::Crowd> crowd;
  std::vector<std::vector<scenes::PosedGroup>> posed;  // of the crowd, each frame

  std::uint32_t character_count() const;
  std::size_t most_leaves() const;  // of one character
};

// A scene that `cab sweep` offers by name. character_count: of detailed rigs and ropes; 0: the scene's default. Throws
// std::runtime_error if a file of the scene is missing.
SweepScene make_sweep_scene(const std::string& name, std::uint32_t character_count);

// The user's own files, as `cab run` takes them.
SweepScene make_files_scene(const WorldOptions& options);

// Two links that touch. In a crowd, a group and an instance of it name a character. In other scenes the group is the
// character, and the instance is 0.
struct SweepHit {
  std::uint32_t frame;
  std::uint32_t group_a, instance_a, link_a;
  std::uint32_t group_b, instance_b, link_b;
  auto operator<=>(const SweepHit&) const = default;
};

// A scene in an engine. The scene must outlive it.
class SweepWorld {
 public:
  SweepWorld(const SweepScene& scene, Isa isa, std::uint32_t thread_count);
  Isa isa() const;
  std::uint32_t thread_count() const;

  // Runs all frames by a function like run_frame and returns the sum of their stats. *hits (may be null) receives the
  // touching links, sorted.
  FrameStats run(const Policies& policies, std::vector<SweepHit>* hits = nullptr, RunFrame frame = run_frame);

  // An upper limit for the leaf pairs between characters whose bounds overlap. For frames of a few characters, between
  // all that are paired.
  std::uint64_t most_leaf_pairs();

 private:
  const SweepScene& scene_;
  std::unique_ptr<EngineSession> frames_;
  std::unique_ptr<CrowdSession> crowd_;
};

}  // namespace cab::perf
