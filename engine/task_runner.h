// Running tasks: on the calling thread, on TBB, or on the caller's own scheduler.
#pragma once

#include <cab/types.h>

#include <algorithm>
#include <atomic>
#include <memory>

namespace cab {

class TaskRunner {
 public:
  virtual ~TaskRunner() = default;
  virtual std::uint32_t worker_count() const = 0;

  // Calls task(context, t, worker) for every t < task_count, as Scheduler::parallel_for promises. Each call runs in
  // the library's floating-point mode.
  virtual void run(std::uint32_t task_count, void (*task)(void* context, std::uint32_t task, std::uint32_t worker),
                   void* context) = 0;

  // While set, the calling thread runs all tasks as worker 0, in its own floating-point mode: for work that is over before
  // other threads would begin.
  bool alone = false;

  // Runs body(task, worker) for every task.
  template <class Body>
  void for_each(std::uint32_t task_count, Body&& body) {
    if (task_count == 0) return;
    if (alone) {
      for (std::uint32_t task = 0; task < task_count; ++task) body(task, std::uint32_t{0});
      return;
    }
    run(
        task_count,
        [](void* context, std::uint32_t task, std::uint32_t worker) { (*static_cast<Body*>(context))(task, worker); },
        &body);
  }

  // The same, every worker taking the next task that none has taken: when a task runs, all before it run or are done,
  // so a task may wait for those before it.
  template <class Body>
  void for_each_in_turn(std::uint32_t task_count, Body&& body) {
    std::atomic<std::uint32_t> next{0};
    for_each(alone ? 1 : std::min(worker_count(), task_count), [&](std::uint32_t, std::uint32_t worker) {
      for (std::uint32_t task = next++; task < task_count; task = next++) body(task, worker);
    });
  }
};

std::unique_ptr<TaskRunner> make_serial_task_runner();
std::unique_ptr<TaskRunner> make_caller_task_runner(const Scheduler& scheduler);

// thread_count 0 = every core.
std::unique_ptr<TaskRunner> make_tbb_task_runner(std::uint32_t thread_count);

}  // namespace cab
