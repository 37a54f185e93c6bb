// What a terminal shows of a run that is under way.
#pragma once

#include <cstdint>
#include <string>

namespace cab::perf {

// Says how far a run is, and how long it still takes (time_left). Empty in the first quarter of a second, so that
// nothing flickers where there is nothing to wait for, unless a long step is next. total is above 0.
std::string progress_line(const std::string& label, std::uint64_t done, std::uint64_t total, double seconds_passed,
                          bool long_step_is_next = false);

}  // namespace cab::perf
