// The clock of measurements that other users of the machine do not change.
#pragma once

#include <ctime>

namespace cab::perf {

// The processor time of the process, summed over threads.
inline double processor_seconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace cab::perf
