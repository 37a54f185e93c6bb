// Task runners on the calling thread and on the caller's scheduler.
#include "engine/step/task_runner.h"

#include "engine/step/task_roll.h"
#include "kernels/float_mode.h"

#include <algorithm>
#include <atomic>
#include <new>

namespace cab {
namespace {

class SerialTaskRunner final : public TaskRunner {
 public:
  std::uint32_t worker_count() const override { return 1; }
  void run(std::uint32_t task_count, void (*task)(void*, std::uint32_t, std::uint32_t), void* context) override {
    const kernel::FloatMode mode;
    for (std::uint32_t t = 0; t < task_count; ++t) task(context, t, 0);
  }
};

// Gives the caller's scheduler at most so many tasks at a time as a TaskRoll has, and itself as their context: a
// scheduler that calls a task too late finds it still there.
class CallerTaskRunner final : public TaskRunner {
 public:
  explicit CallerTaskRunner(const Scheduler& scheduler) : scheduler_(scheduler), roll_(scheduler.worker_count) {}
  std::uint32_t worker_count() const override { return scheduler_.worker_count; }
  void run(std::uint32_t task_count, void (*task)(void*, std::uint32_t, std::uint32_t), void* context) override {
    task_ = task;
    context_ = context;
    for (first_ = 0; first_ < task_count; first_ += TaskRoll::kMostTasks)
      run_some(std::min(TaskRoll::kMostTasks, task_count - first_));
  }

 private:
  void run_some(std::uint32_t count) {
    has_thrown_ = false;
    roll_.open(count);
    scheduler_.parallel_for(scheduler_.user, count, run_one, this);
    const bool is_complete = roll_.close();
    if (has_thrown_) throw std::bad_alloc();
    if (roll_.has_refused()) throw BrokenSchedule(Status::kBadTask);
    if (!is_complete) throw BrokenSchedule(Status::kTasksLeft);
  }

  static void run_one(void* runner, std::uint32_t task, std::uint32_t worker) {
    CallerTaskRunner& self = *static_cast<CallerTaskRunner*>(runner);
    if (!self.roll_.begin(task, worker)) return;
    try {
      const kernel::FloatMode mode;  // the caller's threads have their own
      self.task_(self.context_, self.first_ + task, worker);
    } catch (const std::exception&) {
      self.has_thrown_ = true;  // not through the caller's code
    }
    self.roll_.end(worker);
  }

  Scheduler scheduler_;
  TaskRoll roll_;
  void (*task_)(void*, std::uint32_t, std::uint32_t) = nullptr;
  void* context_ = nullptr;
  std::uint32_t first_ = 0;  // of the tasks that the scheduler has
  std::atomic<bool> has_thrown_{false};
};

}  // namespace

std::unique_ptr<TaskRunner> make_serial_task_runner() { return std::make_unique<SerialTaskRunner>(); }

std::unique_ptr<TaskRunner> make_caller_task_runner(const Scheduler& scheduler) {
  return std::make_unique<CallerTaskRunner>(scheduler);
}

}  // namespace cab
