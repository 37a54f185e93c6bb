// What `cab continuity` accepts.
#pragma once

#include <cab/types.h>

#include <cstdint>
#include <string>

#include "perf/base/options.h"

namespace cab::perf {

struct ContinuityOptions {
  std::uint32_t step_count = 20000;
  Isa isa = Isa::kAuto;
  std::string json_path;  // empty: no file
  std::string csv_path;   // empty: no file
};
Command add_continuity(CLI::App& app);
int continuity_command(const ContinuityOptions& options);

}  // namespace cab::perf
