// Crowds: many characters at once in one world, z up, metres. A crowd is posed frame by frame on demand, so that a
// million characters need no more memory than the frames that are kept.
#pragma once

#include "scenes/crowd/ropes.h"
#include "scenes/import/import.h"
#include "scenes/import/trajectories.h"
#include "scenes/scene.h"

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace cab::scenes {

// One moment of all characters of a group: what BatchInput takes.
struct PosedGroup {
  std::vector<float> poses;         // [character][link][7], kQuaternionTranslation
  std::vector<double> origins;      // [character][3]
  std::vector<float> orientations;  // [character][4], or empty: none is rotated
};

// Characters of one articulation, unsorted in space.
struct CrowdGroup {
  Character figure;  // links and leaves; without poses
  std::uint32_t count = 0;
  // Poses the group at a time in seconds, from 0, without regard to other calls; a posed group may be used again.
  std::function<void(double seconds, PosedGroup& posed)> pose;
};

struct Crowd {
  std::vector<CrowdGroup> groups;
  std::uint32_t count() const;
};

// Whether a crowd scene plays clips.
enum class ClipUse : std::uint8_t { kNone, kOptional, kNeeded };

// A crowd scene by its name: what it needs, and the touching leaf pairs a character in its first frame where they are
// known (0: unknown), with the share by which they may differ at 2000 characters and more.
struct CrowdScene {
  const char* name;
  const char* meaning;
  ClipUse clips;
  bool needs_trajectories;
  double pairs_a_character;
  double tolerance;
};
inline constexpr std::array<CrowdScene, 10> kCrowdScenes = {{
    {"uniform", "humanoids at random places, 1 a square metre", ClipUse::kNone, false, 5.8, .1},
    {"jitter", "humanoids on a 1 m grid, each within 0.25 m", ClipUse::kNone, false, .22, .2},
    {"bottleneck", "recorded pedestrians, playing walking clips", ClipUse::kNeeded, true, 0, 0},
    {"battle", "clips at random places, 1.5 a square metre", ClipUse::kNeeded, false, 0, 0},
    {"spot", "humanoids all in one spot", ClipUse::kNone, false, 0, 0},
    {"line", "humanoids in one line, 0.5 m apart", ClipUse::kNone, false, 0, 0},
    {"giant", "uniform, one of them 100 times as large as the others", ClipUse::kNone, false, 0, 0},
    {"detailed", "uniform, each link of each humanoid or clip in many boxes", ClipUse::kOptional, false, 0, 0},
    {"ropes", "long chains side by side, all slanting the same way", ClipUse::kNone, false, 0, 0},
    {"far", "humanoids at random places of a square of 1e7 m", ClipUse::kNone, false, 0, 0},
}};

// What crowd scenes are made from. up: the axis that points up in the clips, or 0 for that along which each is tallest.
struct CrowdSources {
  std::vector<Clip> clips;
  Trajectories trajectories;
  char up = 0;
  std::uint32_t boxes_per_link = 16;  // of `detailed`
  RopeOptions ropes;
};

// Makes a scene of kCrowdScenes with `count` characters, at least 1. Throws std::invalid_argument for another name, for
// no characters, where a source is missing that the scene needs, and where an option is out of range.
Crowd make_crowd(const std::string& name, std::uint32_t count, CrowdSources sources = {});

// The crowd at one time; posed[g] is of group g.
void pose_crowd(const Crowd& crowd, double seconds, std::vector<PosedGroup>& posed);

// FNV-1a hash of the bits of every pose, origin and orientation.
std::uint64_t pose_hash(const std::vector<PosedGroup>& posed);

}  // namespace cab::scenes
