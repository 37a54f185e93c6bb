// What `cab sweep` accepts.
#pragma once

#include <cab/types.h>

#include <cstdint>
#include <string>
#include <vector>

#include "perf/base/options.h"
#include "perf/tools/run/run_world.h"

namespace cab::perf {

struct SweepOptions {
  WorldOptions world;
  std::vector<std::string> scenes;                 // names of scene_list(); empty: the defaults, or the files alone
  std::vector<std::vector<std::uint32_t>> values;  // of each row of policy_table(); empty: see choose_policies
  std::vector<Isa> isas = {Isa::kAuto};
  std::vector<std::uint32_t> thread_counts = {1};  // 0: every core
  std::uint32_t character_count = 0;               // of each crowd; 0: the scene's default
  std::uint32_t rounds = 7;
  std::string json_path;  // empty: no file
  std::string csv_path;   // empty: no file
};
Command add_sweep(CLI::App& app);
int sweep_command(const SweepOptions& options);

}  // namespace cab::perf
