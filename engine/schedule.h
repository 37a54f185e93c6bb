// Running tasks: on the calling thread, on TBB, or on the caller's own scheduler.
#pragma once

#include <cab/types.h>

#include <memory>

namespace cab {

class Schedule {
 public:
  virtual ~Schedule() = default;
  virtual std::uint32_t worker_count() const = 0;

  // Calls task(context, t, worker) for every t < task_count, as Scheduler::parallel_for promises. Each call runs in
  // the library's floating-point mode.
  virtual void run(std::uint32_t task_count, void (*task)(void* context, std::uint32_t task, std::uint32_t worker),
                   void* context) = 0;

  // Runs body(task, worker) for every task.
  template <class Body>
  void for_each(std::uint32_t task_count, Body&& body) {
    if (task_count == 0) return;
    run(
        task_count,
        [](void* context, std::uint32_t task, std::uint32_t worker) { (*static_cast<Body*>(context))(task, worker); },
        &body);
  }
};

std::unique_ptr<Schedule> make_serial_schedule();
std::unique_ptr<Schedule> make_caller_schedule(const Scheduler& scheduler);

// thread_count 0 = every core.
std::unique_ptr<Schedule> make_tbb_schedule(std::uint32_t thread_count);

}  // namespace cab
