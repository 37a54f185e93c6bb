// What a caller's profiler is told: when a phase of a call begins and ends.
#pragma once

#include <cab/types.h>

namespace cab {

// Tells the profiler, if there is one, that a phase lasts as long as a scope.
class Profiled {
 public:
  Profiled(const Profiler& profiler, const char* phase, std::uint32_t worker)
      : profiler_(profiler), phase_(phase), worker_(worker) {
    if (profiler_.begin) profiler_.begin(profiler_.user, phase_, worker_);
  }
  ~Profiled() {
    if (profiler_.end) profiler_.end(profiler_.user, phase_, worker_);
  }
  Profiled(const Profiled&) = delete;
  Profiled& operator=(const Profiled&) = delete;

 private:
  const Profiler& profiler_;
  const char* phase_;
  std::uint32_t worker_;
};

}  // namespace cab
