// What `cab report` accepts.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "perf/base/options.h"

namespace cab::perf {

struct ReportOptions {
  std::vector<std::string> files;
  std::string out_path;             // the page; empty: none
  std::string csv_path;             // intervals; empty: beside the page
  std::string pairs_path;           // empty: no file
  std::string page_path;            // the page of the viewer; empty: it is looked for
  std::optional<double> min_depth;  // metres
  std::uint32_t min_frames = 1;
};
Command add_report(CLI::App& app);
int report_command(const ReportOptions& options);

}  // namespace cab::perf
