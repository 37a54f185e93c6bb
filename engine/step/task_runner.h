// Task runners: run the tasks of a step on the calling thread, on TBB or on the caller's scheduler.
#pragma once

#include <cab/types.h>

#include <exception>
#include <memory>

namespace cab {

// What a runner throws if the caller's scheduler has not run every task once: kBadTask or kTasksLeft.
struct BrokenSchedule : std::exception {
  explicit BrokenSchedule(Status what) : status(what) {}
  Status status;
};

// Runs tasks on workers 0 to worker_count() - 1. A worker runs one task at a time.
class TaskRunner {
 public:
  virtual ~TaskRunner() = default;
  virtual std::uint32_t worker_count() const = 0;

  // Calls task(context, t, worker) once for every t < task_count, and returns when all are done, as
  // Scheduler::parallel_for does. Each task runs in the library's floating-point mode. Throws BrokenSchedule, or
  // std::bad_alloc.
  virtual void run(std::uint32_t task_count, void (*task)(void* context, std::uint32_t task, std::uint32_t worker),
                   void* context) = 0;

  // While set, for_each runs all tasks on the calling thread as worker 0, and leaves the floating-point mode as it is:
  // for frames that end before other threads start.
  bool alone = false;

  // Calls body(task, worker) once for every task < task_count.
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
};

// All tasks on the calling thread.
std::unique_ptr<TaskRunner> make_serial_task_runner();

// All tasks on the caller's scheduler, which is copied.
std::unique_ptr<TaskRunner> make_caller_task_runner(const Scheduler& scheduler);

// At most thread_count threads, and no more than cores; 0 uses every core. Null without TBB: such a library is built
// with task_runner_tbb_absent.cpp instead of task_runner_tbb.cpp.
std::unique_ptr<TaskRunner> make_tbb_task_runner(std::uint32_t thread_count);

// Whether TBB is built in.
bool has_tbb();

}  // namespace cab
