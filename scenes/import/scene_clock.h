// The frames at which an animation with keys at free times is sampled.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "scenes/import/import_report.h"

namespace cab::scenes {

struct SceneClock {
  double first_tick = 0;
  double ticks_per_frame = 0;
  double frame_seconds = 1.0 / 30;
  std::uint32_t frame_count = 1;
};

// What a clock is made of besides the keys.
struct ClockOptions {
  double ticks_per_second = 0;  // 0: nobody says it
  double own_rate = 0;          // frames a second that the file itself states; 0: none
  std::size_t node_count = 1;   // frames x nodes are limited
};

// The times of the keys of one node's positions, rotations or scales, in ticks and in order.
using KeyTimes = std::vector<double>;

// The frames of an animation: from the first to the last key of all tracks. docs/import.md says which step they have:
// the one that tracks keep for most of their time, weighted with that time and of equal ones the smaller, and what
// comes in its place. Tracks of one key have no say, since assimp gives a track that a file lacks one key at 0. `notes`
// and `alterations` say where keys lie between frames. `path` is the file in messages. Throws ImportError.
SceneClock make_clock(std::vector<KeyTimes> tracks, const ClockOptions& options, const std::string& path,
                      std::vector<std::string>& notes, std::vector<Alteration>& alterations);

// Throws ImportError if frames x nodes are too many.
void check_frames(double frames, std::size_t node_count, const std::string& path);

}  // namespace cab::scenes
