// Tasks over the instances of all batches of an engine.
#pragma once

#include "engine/step/frame_context.h"

#include <algorithm>

namespace cab {

// Which batch a task is of, and its number among the tasks of that batch.
struct BatchTask {
  std::uint32_t batch, run;
};

// Gives every batch as many tasks as tasks_of(batch) says, the first batch those from `first` on. Returns the end of
// all tasks.
template <class TasksOf>
std::uint32_t lay_out_tasks(StoredBatches batches, TasksOf&& tasks_of, std::uint32_t first = 0) {
  for (const auto& slot : batches) {
    slot->batch.first_task = first;
    first += tasks_of(slot->batch);
  }
  return first;
}

inline BatchTask batch_task(StoredBatches batches, std::uint32_t task) {
  const auto above = std::upper_bound(batches.begin(), batches.end(), task,
                                      [](std::uint32_t t, const auto& slot) { return t < slot->batch.first_task; });
  const auto index = static_cast<std::uint32_t>(above - batches.begin()) - 1;
  return {index, task - batches[index]->batch.first_task};
}

}  // namespace cab
