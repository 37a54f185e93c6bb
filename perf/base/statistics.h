// Statistics of repeated measurements, and the phases of a frame that are measured.
#pragma once

#include "layout/frame_stats.h"

#include <vector>

namespace cab::perf {

// The median, the least and the greatest of measured values.
struct Spread {
  double median = 0, least = 0, most = 0;
};

// Statistics of at least one value. With an even number of values, the median is the upper of the two in the middle.
Spread spread_of(std::vector<double> values);
double median(std::vector<double> values);

// Of measurements in turns: those of one over those of another, round by round, as far as both have rounds.
Spread ratio_of(const std::vector<double>& one, const std::vector<double>& other);

// A phase of a frame. Its seconds are summed over threads.
struct Phase {
  const char* name;  // in a table
  const char* key;   // in a file
  double FrameStats::*seconds;
};

// The phases that tables and files list besides the total, in this order.
inline constexpr Phase kPhases[] = {
    {"update", "update", &FrameStats::seconds_update},
    {"broad phase", "broad", &FrameStats::seconds_broad},
    {"test", "test", &FrameStats::seconds_test},
    {"query", "query", &FrameStats::seconds_query},
};

}  // namespace cab::perf
