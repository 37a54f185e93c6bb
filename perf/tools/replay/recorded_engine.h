// An engine whose frames are recorded as they run: what a host of cab::record does, for scenes and crowds.
#pragma once

#include <cab/record.h>

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "perf/base/engine_session.h"
#include "scenes/crowd/crowd.h"
#include "scenes/scene.h"

namespace cab::perf {

// How frames are run and written.
struct RecordSettings {
  std::string path;
  std::string title;
  Policies policies;
  float margin = 0;
  float min_depth = 0;
  bool containment = true;
  Isa isa = Isa::kAuto;
  std::uint32_t thread_count = 1;  // 0: every core
  double metres_per_unit = 0;      // 0: unknown
  char up = 0;
  bool compress = false;
  float pose_step = 0;  // RecorderOptions::pose_step
};

// What was recorded.
struct RecordTotals {
  std::uint32_t frames = 0;
  std::uint64_t hits = 0;
  std::uint64_t bytes = 0;
};

// Each function runs frame after frame, every character in each, and records them. Hits have contacts if there is an
// exact test. on_frame is called after each. Throws std::runtime_error that says what the engine or the file refuses.
using OnFrame = std::function<void()>;

// Frames of a scene, whose characters touch as `cab run` has it: each pair of the scene or, if it names none, every
// two, and with `within` the links of each as well.
RecordTotals record_scene(const scenes::Scene& scene, FrameRange frames, bool within, const RecordSettings& settings,
                          const OnFrame& on_frame);

// frame_count frames of a crowd, 1 / kCrowdFramesPerSecond apart, with its level.
RecordTotals record_crowd(const scenes::Crowd& crowd, std::uint32_t frame_count, const RecordSettings& settings,
                          const OnFrame& on_frame);

}  // namespace cab::perf
