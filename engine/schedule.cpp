#include "engine/schedule.h"

#include "kernels/float_mode.h"

namespace cab {
namespace {

class SerialSchedule final : public Schedule {
 public:
  std::uint32_t worker_count() const override { return 1; }
  void run(std::uint32_t task_count, void (*task)(void*, std::uint32_t, std::uint32_t), void* context) override {
    const kernel::FloatMode mode;
    for (std::uint32_t t = 0; t < task_count; ++t) task(context, t, 0);
  }
};

// A task as the caller's scheduler sees it: ours, in our floating-point mode.
struct Guarded {
  void (*task)(void*, std::uint32_t, std::uint32_t);
  void* context;
};

void run_guarded(void* context, std::uint32_t task, std::uint32_t worker) {
  const kernel::FloatMode mode;
  const Guarded& guarded = *static_cast<const Guarded*>(context);
  guarded.task(guarded.context, task, worker);
}

class CallerSchedule final : public Schedule {
 public:
  explicit CallerSchedule(const Scheduler& scheduler) : scheduler_(scheduler) {}
  std::uint32_t worker_count() const override { return scheduler_.worker_count; }
  void run(std::uint32_t task_count, void (*task)(void*, std::uint32_t, std::uint32_t), void* context) override {
    Guarded guarded{task, context};
    scheduler_.parallel_for(scheduler_.user, task_count, run_guarded, &guarded);
  }

 private:
  Scheduler scheduler_;
};

}  // namespace

std::unique_ptr<Schedule> make_serial_schedule() { return std::make_unique<SerialSchedule>(); }

std::unique_ptr<Schedule> make_caller_schedule(const Scheduler& scheduler) {
  return std::make_unique<CallerSchedule>(scheduler);
}

}  // namespace cab
