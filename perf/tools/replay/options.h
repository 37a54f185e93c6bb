// What `cab record` and `cab replay` accept.
#pragma once

#include <cab/types.h>

#include <cstdint>
#include <optional>
#include <string>

#include "perf/base/engine_session.h"
#include "perf/base/options.h"

namespace cab::perf {

// How a recording is written, for all commands that write one.
struct RecordFileOptions {
  std::string path;  // empty: none is written
  bool compress = false;
  float pose_step = 0;
  bool is_aside = false;  // another command reads it and removes it: nothing is told about it
};

// Adds `option` FILE.cab, --compress and --pose-step.
CLI::Option* add_record_file(CLI::App& command, const std::string& option, RecordFileOptions& file,
                             const std::string& meaning);

struct RecordOptions {
  std::string scene;
  RecordFileOptions file;
  std::optional<FrameRange> frames;   // empty: those of the scene; of a crowd the first 30
  std::uint32_t character_count = 0;  // of a crowd; 0: that of the scene
  float margin = 0;
  Policies policies;
  Isa isa = Isa::kAuto;
  std::uint32_t thread_count = 1;  // 0: every core
};
Command add_record(CLI::App& app);
int record_command(const RecordOptions& options);

struct ReplayOptions {
  std::string file;
  Policies policies;                   // those whose bit is set below
  std::uint32_t changed_policies = 0;  // by row of policy_table()
  std::vector<Isa> isas;               // empty: the best
  std::uint32_t thread_count = 1;      // 0: every core
  std::string json_path;               // empty: no file
};
Command add_replay(CLI::App& app);
int replay_command(const ReplayOptions& options);

}  // namespace cab::perf
