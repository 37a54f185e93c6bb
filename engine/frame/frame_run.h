// A frame in progress: what its steps share, and what a step is.
#pragma once

#include "engine/hits/report.h"
#include "engine/session/call.h"
#include "engine/step/timed.h"

#include <atomic>
#include <optional>
#include <utility>

namespace cab {

struct FrameRun {
  FrameRun(Call held, Engine& of, FrameJob& what)
      : engine(of), job(what), call(std::move(held)), sink{&what, &of.hit_store} {}

  Worker& worker(std::uint32_t index) const { return engine.pool[index]; }

  Engine& engine;
  FrameJob& job;
  Call call;
  const Clock::time_point start = Clock::now();
  HitSink sink;
  std::optional<FrameContext> characters, sequences;
  std::uint64_t failed_before = 0;            // Engine::frames_failed before the frame was let in
  bool has_last_hits = false;                 // whether the store holds the hits of the last frame, until it is written
  std::uint32_t last_blocks = 0;              // in how many blocks
  std::uint32_t steps_begun = 0;              // of kFrameSteps (engine/frame/frame.cpp)
  std::uint32_t task_count = 0;               // of the last of them
  std::uint32_t first_task = 0;               // of those of its tasks that the caller runs now (next_tasks)
  std::uint32_t tasks_given = 0;              // how many these are
  std::atomic<std::uint32_t> tasks_ended{0};  // of these
};

// A step of a frame: tasks that may run at the same time.
struct FrameStep {
  const char* name;  // what a Profiler is told
  // What is done on one thread after the tasks of the step before, and how many tasks there are; 0: the step is not
  // needed.
  std::uint32_t (*begin)(FrameRun& run);
  void (*task)(FrameRun& run, std::uint32_t task, std::uint32_t worker);
};

}  // namespace cab
