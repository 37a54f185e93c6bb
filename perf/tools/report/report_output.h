// What a report writes: rows of CSV, and the JSON that the page shows.
#pragma once

#include <cstdint>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "perf/tools/report/contact_intervals.h"
#include "perf/tools/report/report_file.h"

namespace cab::perf {

void write_interval_header(std::ostream& out);
void write_interval(std::ostream& out, const ReportFile& file, const Interval& interval);

// A row of the same columns that says what could not be read.
void write_problem(std::ostream& out, const ReportFile& file, const std::string& problem);

void write_pair_header(std::ostream& out);
void write_pair(std::ostream& out, const ReportFile& file, const PairTotals& pair);

// The share of the frames that were read.
double share_of_frames(const ReportFile& file, const PairTotals& pair);

// What the page holds of a report.
struct ReportPage {
  std::vector<Interval> intervals;  // the worst ones
  std::vector<PairTotals> pairs;    // likewise
  std::uint64_t interval_count = 0;
  std::uint64_t pair_count = 0;
  std::vector<std::optional<std::uint32_t>> recordings;  // by file: index of the embedded recording
  std::optional<double> min_depth;
  std::uint32_t min_frames = 1;
  std::string csv_name;  // empty: none
};

// The text of the JSON; perf/view/src/report/types.ts has its members.
std::string report_json(const std::vector<ReportFile>& files, const ReportPage& page);

}  // namespace cab::perf
