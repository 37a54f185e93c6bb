// What `cab view` accepts.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "perf/base/options.h"

namespace cab::perf {

struct ViewOptions {
  std::vector<std::string> files;  // recordings
  std::string out_path;            // empty: as the first recording, with .html
  std::string page_path;           // of the viewer; empty: beside the command
  std::uint32_t frame = 0;         // that the link opens
};
Command add_view(CLI::App& app);
int view_command(const ViewOptions& options);

}  // namespace cab::perf
