// All scenes by name: what each one is, what makes it, and which commands offer it. `cab crowd`, `cab peers` and
// `cab sweep` read their scenes here. A new scene is a function that makes it and one row of scene_list.cpp.
#pragma once

#include "scenes/crowd/crowd.h"
#include "scenes/scene.h"

#include <cab/span.h>

#include <cstdint>
#include <string>
#include <variant>

namespace cab::scenes {

// The commands that offer scenes by name. A row joins them by |.
enum SceneUse : std::uint8_t {
  kCrowdCommand = 1,
  kPeersCommand = 2,
  kSweepCommand = 4,
  kSweepByDefault = 8,  // `cab sweep` runs the scene when the user names no scene
};

// A few characters over many frames. `cab sweep` runs the frames first_frame .. end_frame - 1.
struct FrameScene {
  Scene (*make)(std::uint32_t frame_count);  // makes at least the frames 0 .. frame_count - 1
  std::uint32_t first_frame;
  std::uint32_t end_frame;
};

// Whether a crowd scene plays clips.
enum class ClipUse : std::uint8_t { kNone, kOptional, kNeeded };

using MakeCrowd = Crowd (*)(std::uint32_t count, CrowdSources sources);

// A crowd of as many characters as the caller wants.
struct CrowdScene {
  MakeCrowd make;
  ClipUse clips = ClipUse::kNone;
  bool needs_trajectories = false;
  // The touching leaf pairs per character in the first frame, 0 if unknown, and the share by which the measured number
  // may differ with 2000 characters and more.
  double pairs_per_character = 0;
  double tolerance = 0;
};

// A crowd whose size is part of its name.
struct SizedCrowdScene {
  MakeCrowd make;
  std::uint32_t character_count;
  bool takes_count;  // the caller may choose another character_count, because the name states the size of a character
  std::uint32_t boxes_per_link;
  RopeOptions ropes;
  std::uint32_t rig_links;
};

struct NamedScene {
  const char* name;
  const char* meaning;  // one line
  std::uint8_t uses;    // SceneUse bits
  std::variant<FrameScene, CrowdScene, SizedCrowdScene> source;

  bool is_for(SceneUse use) const { return (uses & use) != 0; }
};

// All rows, in the order in which commands list them.
Span<const NamedScene> scene_list();

// The row of a scene that a command offers, or null if the command offers no scene of that name.
const NamedScene* find_scene(SceneUse command, const std::string& name);

// The names of all scenes that a command offers, joined by a separator.
std::string scene_names(SceneUse command, const char* separator);

// A crowd scene of `cab crowd`. Throws std::invalid_argument, with the names of all crowd scenes, for any other name.
const CrowdScene& crowd_scene(const std::string& name);

// Makes a crowd scene with `count` characters, at least 1. Throws std::invalid_argument if the name is unknown, if
// count is 0, if the sources lack what the scene needs, or if an option is out of range.
Crowd make_crowd(const std::string& name, std::uint32_t count, CrowdSources sources = {});

// Makes a sized crowd. If the scene takes a count and count is not 0, it replaces the row's own number of characters.
Crowd make_sized_crowd(const SizedCrowdScene& scene, std::uint32_t count);

}  // namespace cab::scenes
