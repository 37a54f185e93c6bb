// Which tasks of a step have begun, and which workers have one: whoever runs tasks for the engine may skip, repeat or
// invent some.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <vector>

namespace cab {

class TaskRoll {
 public:
  // The most tasks that a roll has at a time.
  static constexpr std::uint32_t kMostTasks = 1u << 16;

  explicit TaskRoll(std::uint32_t workers) : workers_(workers) {}

  // Opens the roll for tasks 0 to count - 1, none of which has begun.
  void open(std::uint32_t count);

  // Begins a task on a worker. Refuses, and returns false, if there is no such task or worker, if the task has begun
  // before, or if the worker has another one. Any thread may call this at any time.
  bool begin(std::uint32_t task, std::uint32_t worker);

  // Ends the task of a worker.
  void end(std::uint32_t worker) { workers_[worker].is_busy.store(false, std::memory_order_release); }

  // Refuses all that begins from now on, and waits for the tasks that have begun. Returns whether all of them have.
  bool close();

  // Whether a task was refused since the roll was opened.
  bool has_refused() const { return has_refused_.load(std::memory_order_relaxed); }

 private:
  bool refuse() {
    has_refused_.store(true, std::memory_order_relaxed);
    return false;
  }

  struct alignas(64) Worker {
    std::atomic<bool> is_busy{false};
  };

  std::vector<Worker> workers_;
  std::array<std::atomic<std::uint32_t>, kMostTasks / 32> begun_{};  // a bit per task
  std::atomic<std::uint32_t> count_{0};
  std::atomic<bool> has_refused_{false};
};

}  // namespace cab
