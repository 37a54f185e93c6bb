// Task runners on the calling thread and on the caller's scheduler.
#include "engine/task_runner.h"

#include "kernels/float_mode.h"

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

// A task and its context, as the caller's scheduler passes them on. run_guarded runs the task in the library's
// floating-point mode.
struct Guarded {
  void (*task)(void*, std::uint32_t, std::uint32_t);
  void* context;
};

void run_guarded(void* context, std::uint32_t task, std::uint32_t worker) {
  const kernel::FloatMode mode;
  const Guarded& guarded = *static_cast<const Guarded*>(context);
  guarded.task(guarded.context, task, worker);
}

class CallerTaskRunner final : public TaskRunner {
 public:
  explicit CallerTaskRunner(const Scheduler& scheduler) : scheduler_(scheduler) {}
  std::uint32_t worker_count() const override { return scheduler_.worker_count; }
  void run(std::uint32_t task_count, void (*task)(void*, std::uint32_t, std::uint32_t), void* context) override {
    Guarded guarded{task, context};
    scheduler_.parallel_for(scheduler_.user, task_count, run_guarded, &guarded);
  }

 private:
  Scheduler scheduler_;
};

}  // namespace

std::unique_ptr<TaskRunner> make_serial_task_runner() { return std::make_unique<SerialTaskRunner>(); }

std::unique_ptr<TaskRunner> make_caller_task_runner(const Scheduler& scheduler) {
  return std::make_unique<CallerTaskRunner>(scheduler);
}

}  // namespace cab
