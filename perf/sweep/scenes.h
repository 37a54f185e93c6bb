// The scenes of `cab sweep`: frames of a few characters, or crowds, behind one face.
#pragma once

#include <cab/cab.h>

#include <array>
#include <compare>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "perf/base/crowd_session.h"
#include "perf/base/engine_session.h"
#include "perf/run/run_world.h"
#include "perf/sweep/box_growth.h"
#include "scenes/crowd.h"
#include "scenes/scene.h"

namespace cab::perf {

// A scene that can be asked for by name.
struct SweepSceneName {
  const char* name;
  const char* meaning;
  bool by_default;
};
inline constexpr std::array<SweepSceneName, 27> kSweepScenes = {{
    {"chains3", "table 1 of the paper: two chains that collide, links 3:1", true},
    {"chains6", "table 2: links 6:1", true},
    {"dented", "table 3: links that are not convex", true},
    {"braid", "table 4: two strands wound about each other", true},
    {"hand", "table 5: a hand flicks a ball", true},
    {"cmu", "two captured people who touch (Debian's package assimp-testmodels)", true},
    {"uniform-100", "a crowd of 100 humanoids at random places", false},
    {"uniform-1000", "of 1000", true},
    {"uniform-10000", "of 10000", false},
    {"detailed-16", "a crowd of 100 humanoids of 16 boxes", false},
    {"detailed-32", "of 32 boxes", false},
    {"detailed-64", "of 64 boxes", false},
    {"detailed-128", "of 128 boxes", false},
    {"detailed-256", "of 256 boxes", true},
    {"detailed-512", "of 512 boxes", false},
    {"detailed-1024", "of 1024 boxes", false},
    {"ropes-64", "16 straight ropes of 64 links that hardly touch", true},
    {"ropes-128", "of 128 links", false},
    {"ropes-256", "of 256 links", false},
    {"ropes-512", "of 512 links", false},
    {"ropes-1024", "of 1024 links", false},
    {"wavy-64", "16 waves of 64 links", false},
    {"coiled-64", "16 springs of 64 links", false},
    {"braided-64", "16 ropes of 64 links in braids", false},
    {"spot-30", "30 humanoids all in one spot", false},
    {"giant-300", "300 humanoids, one of them 100 times as large", false},
    {"far-300", "300 humanoids in a square of 1e7 m", false},
}};

// The scenes whose names are `family`, a minus and a number, by that number.
struct SweepMember {
  std::string name;
  std::uint32_t number;
};
std::vector<SweepMember> sweep_family(const std::string& family);

// A scene in memory: frames of a few characters, or a crowd with its poses.
struct SweepScene {
  std::string name;
  std::uint32_t frame_count = 0;
  FrameRange frames;                           // of `scene`
  std::shared_ptr<const scenes::Scene> scene;  // or:
  std::shared_ptr<const scenes::Crowd> crowd;
  std::vector<std::vector<scenes::PosedGroup>> posed;  // of the crowd, each frame

  std::uint32_t character_count() const;
  std::size_t most_leaves() const;  // of one character
};

// By its name in kSweepScenes. character_count: of detailed rigs and ropes; 0: the default. Throws std::runtime_error
// if the files of cmu are missing.
SweepScene make_sweep_scene(const std::string& name, std::uint32_t character_count);

// The user's own files, as `cab run` takes them.
SweepScene make_files_scene(const WorldOptions& options);

// Some of the scene's poses of each of its figures.
std::vector<PosedFigure> sample_figures(const SweepScene& scene);

// Two links that touch. Instances are those of a crowd's group, 0 elsewhere; groups are characters there.
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

  // Runs all frames and sums. hits (optional) receives the touching links, sorted.
  FrameStats run(const Policies& policies, std::vector<SweepHit>* hits = nullptr);

  // An upper limit for the leaf pairs between characters that come near each other; of frames, between all that are
  // paired.
  std::uint64_t most_leaf_pairs();

 private:
  const SweepScene& scene_;
  std::unique_ptr<EngineSession> frames_;
  std::unique_ptr<CrowdSession> crowd_;
};

}  // namespace cab::perf
