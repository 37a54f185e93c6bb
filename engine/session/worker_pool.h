// The workers of an engine, and the runner of their tasks.
#pragma once

#include "engine/step/task_runner.h"

#include <memory>
#include <vector>

namespace cab {

struct ExactScratch;
struct PoseScratch;
struct Worker;
struct WorkerDelete {
  void operator()(Worker* worker) const;
};
using WorkerPtr = std::unique_ptr<Worker, WorkerDelete>;

struct WorkerPool {
  std::unique_ptr<TaskRunner> tasks;
  std::vector<WorkerPtr> workers;

  Worker& operator[](std::uint32_t worker) const { return *workers[worker]; }

  // Of a worker, for those that need no more of it (engine/session/memory.cpp).
  PoseScratch& pose_of(std::uint32_t worker) const;
  ExactScratch& exact_of(std::uint32_t worker) const;

  // Number of workers that run tasks in this frame.
  std::size_t working_count() const { return tasks->alone ? 1 : workers.size(); }
};

}  // namespace cab
