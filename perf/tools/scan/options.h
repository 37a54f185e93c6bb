// What `cab scan` accepts.
#pragma once

#include <string>
#include <vector>

#include "perf/base/options.h"

namespace cab::perf {

struct ScanOptions {
  std::vector<std::string> arguments;  // of the Python package cab_scan, which reads them
};
Command add_scan(CLI::App& app);
int scan_command(const ScanOptions& options);

}  // namespace cab::perf
