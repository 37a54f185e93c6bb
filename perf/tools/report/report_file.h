// One recording of a report: what is known of it besides its contacts, and how it is read.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "perf/tools/report/contact_intervals.h"
#include "perf/tools/report/recording_names.h"

namespace cab::perf {

struct ReportFile {
  std::string path;
  std::string title;
  std::uint64_t bytes = 0;
  bool is_open = false;  // false: nothing of it could be read, as the one problem says
  std::uint32_t frames = 0;
  std::uint32_t frames_read = 0;
  double seconds_per_frame = 0;  // 0: unknown
  double metres_per_unit = 0;    // 0: unknown; then depths stay in the recording's unit
  bool has_depths = false;       // of any hit
  bool has_triangles = false;    // likewise
  std::vector<std::string> problems;
  RecordingNames names;

  // What the report found in it.
  std::uint64_t interval_count = 0;
  std::uint64_t pair_count = 0;
  std::optional<Interval> worst;
};

// Reads a recording and tells each of its intervals, whose depths are in metres where the unit is known. `advance` is
// told what share of the file was read, from 0 to 1. What cannot be read becomes a problem; nothing is thrown for it.
ReportFile read_report_file(const std::string& path, std::uint32_t index,
                            const std::function<void(const Interval&)>& found,
                            const std::function<void(double)>& advance);

}  // namespace cab::perf
