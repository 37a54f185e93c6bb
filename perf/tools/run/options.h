// What `cab run` and `cab inspect` accept.
#pragma once

#include <cab/types.h>

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "perf/base/engine_session.h"
#include "perf/base/options.h"
#include "perf/tools/replay/options.h"
#include "perf/tools/run/run_world.h"

namespace cab::perf {

// Links of one character at most so many joints apart are not tested against each other, unless --hops says otherwise.
inline constexpr std::uint32_t kDefaultHops = 2;

struct RunOptions {
  WorldOptions world;
  std::optional<FrameRange> frames;  // empty: all frames
  Policies policies;
  Isa isa = Isa::kAuto;
  std::uint32_t thread_count = 1;  // 0: every core
  bool within = false;             // also the links of one character against each other
  float min_depth = 0;             // metres; hits that are less deep are left out
  bool containment = true;         // FrameJob::containment
  bool stats = false;              // also what the engine counted and timed
  bool quiet = false;              // no notes, but warnings
  std::string json_path;           // empty: no file
  std::string hits_path;           // empty: no file
  RecordFileOptions recording;     // of the same frames
};
// Adds FILE..., the options that turn files into a world, and which frames and pairs of links are tested; sets what
// holds without them.
void add_run_of_files(CLI::App& command, RunOptions& run, const std::string& meaning);
Command add_run(CLI::App& app);
int run_command(const RunOptions& options);

struct InspectOptions {
  std::string file;
  std::optional<std::uint32_t> frame = 0;    // empty: the last one
  std::array<double, 3> offset = {0, 0, 0};  // metres
  std::optional<double> metres_per_unit;     // empty: as the file says, or 1; kAutoUnit: guessed
  double frames_per_second = 0;              // of a file that does not say it; 0: 120
  char up = 0;
  std::string motion_path;  // empty: the file's own motion
  double motion_units = 0;  // metres; 0: as of the file
  std::string animation;    // name or number; empty: the first
  std::optional<scenes::SkinOptions> skin;
  scenes::BodyOptions bodies;
  bool names_frame = false;              // whether `frame` is from the command line
  bool writes_json = false;              // the frame as JSON
  std::vector<std::string> box_options;  // those of the command line that are about the boxes of a frame
  std::string bodies_path;               // changes of bodies; empty: none
  std::string write_bodies_path;         // empty: no file
  Policies policies;
  Isa isa = Isa::kAuto;
  std::string json_path;  // empty: with writes_json standard output

  // The file is read in a child process with these limits; empty: in this process.
  std::optional<scenes::SandboxLimits> sandbox = scenes::kImportSandbox;
};
Command add_inspect(CLI::App& app);
int inspect_command(const InspectOptions& options);

// Adds FILE..., --offset, --units, --fps, --up, --no-sandbox and what says how bodies are made, which `cab sweep`
// accepts too.
CLI::Option* add_world(CLI::App& command, WorldOptions& world, const std::string& meaning);

}  // namespace cab::perf
