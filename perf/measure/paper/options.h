// What `cab paper` accepts.
#pragma once

#include <cab/types.h>

#include <cstdint>
#include <string>
#include <vector>

#include "perf/base/options.h"

namespace cab::perf {

struct PaperOptions {
  std::vector<std::uint32_t> tables = {1, 2, 3, 4, 5};
  std::uint32_t frame_count = 0;  // 0: as many as the paper ran
  Isa isa = Isa::kAuto;
  std::uint32_t thread_count = 1;  // 0: every core
  std::string json_path;           // empty: no file
  std::string csv_path;            // empty: no file
};
Command add_paper(CLI::App& app);
int paper_command(const PaperOptions& options);

}  // namespace cab::perf
