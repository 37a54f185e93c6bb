// The task runner on TBB. Each engine has a TBB arena of its own.
#include "engine/task_runner.h"

#include "kernels/float_mode.h"

#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>

namespace cab {
namespace {

class TbbTaskRunner final : public TaskRunner {
 public:
  // No more threads than cores: they would gain nothing, and TBB warns about them on standard error.
  explicit TbbTaskRunner(std::uint32_t thread_count) : arena_(concurrency(thread_count)) { arena_.initialize(); }
  std::uint32_t worker_count() const override { return static_cast<std::uint32_t>(arena_.max_concurrency()); }
  void run(std::uint32_t task_count, void (*task)(void*, std::uint32_t, std::uint32_t), void* context) override {
    arena_.execute([&] {
      tbb::parallel_for(std::uint32_t{0}, task_count, [&](std::uint32_t t) {
        const kernel::FloatMode mode;
        task(context, t, static_cast<std::uint32_t>(tbb::this_task_arena::current_thread_index()));
      });
    });
  }

 private:
  static int concurrency(std::uint32_t thread_count) {
    const int cores = tbb::info::default_concurrency();
    return thread_count == 0 ? cores : std::min(static_cast<int>(std::min(thread_count, 1u << 16)), cores);
  }

  tbb::task_arena arena_;
};

}  // namespace

std::unique_ptr<TaskRunner> make_tbb_task_runner(std::uint32_t thread_count) {
  return std::make_unique<TbbTaskRunner>(thread_count);
}

bool has_tbb() { return true; }

}  // namespace cab
