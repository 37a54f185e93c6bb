#include "engine/step/task_roll.h"

#include <thread>

namespace cab {

void TaskRoll::open(std::uint32_t count) {
  for (std::uint32_t word = 0; 32 * word < count; ++word) begun_[word].store(0, std::memory_order_relaxed);
  has_refused_.store(false, std::memory_order_relaxed);
  count_.store(count);
}

bool TaskRoll::begin(std::uint32_t task, std::uint32_t worker) {
  if (worker >= workers_.size() || workers_[worker].is_busy.exchange(true)) return refuse();
  // The worker is busy before the count is read, and close() sets the count before it looks for busy workers: one of
  // the two sees the other.
  const std::uint32_t bit = 1u << task % 32;
  if (task < count_.load() && !(begun_[task / 32].fetch_or(bit, std::memory_order_relaxed) & bit)) return true;
  end(worker);
  return refuse();
}

bool TaskRoll::close() {
  const std::uint32_t count = count_.exchange(0);
  for (const Worker& worker : workers_)
    while (worker.is_busy.load()) std::this_thread::yield();
  for (std::uint32_t first = 0; first < count; first += 32) {
    const std::uint32_t all = count - first < 32 ? (1u << (count - first)) - 1 : ~0u;
    if (begun_[first / 32].load(std::memory_order_relaxed) != all) return false;
  }
  return true;
}

}  // namespace cab
