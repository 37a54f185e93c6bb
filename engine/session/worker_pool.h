// The workers of an engine, and the runner of their tasks.
#pragma once

#include "engine/step/task_runner.h"

#include <memory>
#include <vector>

namespace cab {

struct Worker;
struct WorkerDelete {
  void operator()(Worker* worker) const;
};
using WorkerPtr = std::unique_ptr<Worker, WorkerDelete>;

struct WorkerPool {
  std::unique_ptr<TaskRunner> tasks;
  std::vector<WorkerPtr> workers;

  Worker& operator[](std::uint32_t worker) const { return *workers[worker]; }

  // Number of workers that run tasks in this frame.
  std::size_t working_count() const { return tasks->alone ? 1 : workers.size(); }
};

}  // namespace cab
