// `cab record`: writes a recording of a scene that has a name.
#include <algorithm>
#include <iostream>
#include <string>

#include "perf/base/report.h"
#include "perf/base/usage.h"
#include "perf/tools/replay/options.h"
#include "perf/tools/replay/recorded_engine.h"
#include "scenes/import/printable.h"
#include "scenes/scene_list.h"

namespace cab::perf {
namespace {

// How many frames of a crowd are recorded if nobody says it: one second.
constexpr std::uint32_t kCrowdFrames = 30;
constexpr std::uint32_t kCrowdSize = 1000;

RecordTotals record_frames(const scenes::NamedScene& row, const scenes::FrameScene& source,
                           const RecordOptions& options, const RecordSettings& settings) {
  if (options.character_count > 0) throw UsageError("--characters: " + options.scene + " is no crowd");
  const FrameRange frames = options.frames.value_or(FrameRange{source.first_frame, source.end_frame});
  const scenes::Scene scene = source.make(std::max(frames.end, source.end_frame));
  if (frames.end > scene.frame_count)
    throw UsageError("--frames: " + std::string(row.name) + " has " + std::to_string(scene.frame_count) + " frames");
  ProgressBar bar("frames", frames.count());
  return record_scene(scene, frames, false, settings, [&bar] { bar.advance(1); });
}

RecordTotals record_people(const scenes::Crowd& crowd, const RecordOptions& options, RecordSettings& settings) {
  if (options.frames && options.frames->first > 0)
    throw UsageError("--frames: a crowd is recorded from its frame 0 on");
  settings.metres_per_unit = 1;
  settings.up = 'z';
  const std::uint32_t count = options.frames ? options.frames->end : kCrowdFrames;
  ProgressBar bar("frames", count);
  return record_crowd(crowd, count, settings, [&bar] { bar.advance(1); });
}

}  // namespace

int record_command(const RecordOptions& options) {
  check_outputs({{"--out", options.file.path}}, {});
  const scenes::NamedScene* row = scenes::find_scene(scenes::kSweepCommand, options.scene);
  if (row == nullptr) row = scenes::find_scene(scenes::kCrowdCommand, options.scene);
  if (options.policies.exact == Exact::kSurface && options.scene != "skins")
    throw UsageError("--exact surface: needs --scene skins, whose triangles it tests");
  RecordSettings settings;
  settings.path = options.file.path;
  settings.title = row->meaning;
  settings.policies = options.policies;
  settings.margin = options.margin;
  settings.isa = options.isa;
  settings.thread_count = options.thread_count;
  settings.compress = options.file.compress;
  settings.pose_step = options.file.pose_step;
  RecordTotals totals;
  if (const auto* const frames = std::get_if<scenes::FrameScene>(&row->source)) {
    totals = record_frames(*row, *frames, options, settings);
  } else if (const auto* const sized = std::get_if<scenes::SizedCrowdScene>(&row->source)) {
    if (options.character_count > 0 && !sized->takes_count)
      throw UsageError("--characters: the name of " + options.scene + " says how many there are");
    totals = record_people(scenes::make_sized_crowd(*sized, options.character_count), options, settings);
  } else {
    const std::uint32_t count = options.character_count > 0 ? options.character_count : kCrowdSize;
    totals = record_people(scenes::make_crowd(options.scene, count), options, settings);
  }
  std::cout << scenes::printable(options.file.path) << ": " << totals.frames << " frames, " << totals.hits << " hits, "
            << totals.bytes << " bytes\n";
  return 0;
}

}  // namespace cab::perf
