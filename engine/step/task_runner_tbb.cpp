// The task runner on TBB. Each engine has a TBB arena of its own as long as it is there.
#include "engine/step/task_runner.h"

#include "kernels/float_mode.h"

#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <mutex>
#include <utility>
#include <vector>

namespace cab {
namespace {

using ArenaPtr = std::unique_ptr<tbb::task_arena>;

// The arenas that no engine has. TBB 2021.8 keeps 5 to 9 kB of every arena that ends (oneTBB issue 967), so none ends:
// the next engine of as many threads takes it.
class IdleArenas {
 public:
  ArenaPtr take(int threads) {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto found = std::find_if(arenas_.begin(), arenas_.end(),
                                    [threads](const ArenaPtr& arena) { return arena->max_concurrency() == threads; });
    if (found != arenas_.end()) {
      std::swap(*found, arenas_.back());
      ArenaPtr out = std::move(arenas_.back());
      arenas_.pop_back();
      return out;
    }
    arenas_.reserve(made_ + 1);  // so that give() has room
    auto out = std::make_unique<tbb::task_arena>(threads);
    out->initialize();
    ++made_;
    return out;
  }

  void give(ArenaPtr arena) {
    const std::lock_guard<std::mutex> lock(mutex_);
    arenas_.push_back(std::move(arena));
  }

 private:
  std::mutex mutex_;
  std::vector<ArenaPtr> arenas_;
  std::size_t made_ = 0;
};

// Never destroyed, since engines may end after all statics have.
IdleArenas& idle_arenas() {
  static IdleArenas* const arenas = new IdleArenas;
  return *arenas;
}

class TbbTaskRunner final : public TaskRunner {
 public:
  // No more threads than cores: they would gain nothing, and TBB warns about them on standard error.
  explicit TbbTaskRunner(std::uint32_t thread_count) : arena_(idle_arenas().take(concurrency(thread_count))) {}
  TbbTaskRunner(const TbbTaskRunner&) = delete;
  TbbTaskRunner& operator=(const TbbTaskRunner&) = delete;
  ~TbbTaskRunner() override { idle_arenas().give(std::move(arena_)); }
  std::uint32_t worker_count() const override { return static_cast<std::uint32_t>(arena_->max_concurrency()); }
  void run(std::uint32_t task_count, void (*task)(void*, std::uint32_t, std::uint32_t), void* context) override {
    arena_->execute([&] {
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

  ArenaPtr arena_;
};

}  // namespace

std::unique_ptr<TaskRunner> make_tbb_task_runner(std::uint32_t thread_count) {
  return std::make_unique<TbbTaskRunner>(thread_count);
}

bool has_tbb() { return true; }

}  // namespace cab
