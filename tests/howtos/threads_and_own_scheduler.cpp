// A crowd of fighters on one thread, on every core and on the game's threads: the same hits in the same order.
#include <cab/world.h>

#include <atomic>
#include <cstdio>
#include <cstring>
#include <thread>
#include <vector>

// quote
// The game's threads. This example starts them in each call; a game hands the tasks to threads that wait for work.
struct Jobs {
  std::uint32_t worker_count = 4;
  std::atomic<std::uint32_t> tasks_run{0};

  // Runs each task once. No two tasks that run at the same time have the same worker number. Nothing may be thrown.
  static void run(void* user, std::uint32_t count, void (*task)(void*, std::uint32_t, std::uint32_t), void* context) {
    Jobs& jobs = *static_cast<Jobs*>(user);
    std::atomic<std::uint32_t> next{0};
    const auto work = [&](std::uint32_t worker) {
      for (std::uint32_t t = next++; t < count; t = next++) task(context, t, worker);
    };
    std::vector<std::thread> threads;
    for (std::uint32_t worker = 1; worker < jobs.worker_count; ++worker) threads.emplace_back(work, worker);
    work(0);
    for (std::thread& thread : threads) thread.join();
    jobs.tasks_run += count;
  }
};
// end quote

// 32 rows of 32 fighters. In a row they stand 1 apart and are 1.2 wide, so each touches the next one.
static std::vector<cab::Hit> hits_of_crowd(const cab::EngineDesc& desc) {
  constexpr std::uint32_t kCount = 32 * 32;
  const std::int32_t parents[] = {-1};
  const cab::Leaf leaf = {0, cab::axis_aligned_box({0, .9f, 0}, {.6f, .9f, .2f}), {}};
  cab::World world(desc);
  cab::BatchId crowd;
  cab::exit_on_error(world.add_batch({parents, {}, {&leaf, 1}, {}}, kCount, &crowd));
  cab::exit_on_error(world.add_rule({crowd, crowd}));

  std::vector<float> poses;
  std::vector<double> origins;
  for (std::uint32_t i = 0; i < kCount; ++i) {
    const std::uint32_t row = i / 32, column = i % 32;
    poses.insert(poses.end(), {0, 0, 0, 1, 0, 0, 0});
    origins.insert(origins.end(), {1. * column, 0, 2. * row});
  }
  world.input(crowd)->poses.data = poses.data();
  world.input(crowd)->origins = origins;
  cab::exit_on_error(world.run());
  return {world.hits().begin(), world.hits().end()};
}

static bool same(const std::vector<cab::Hit>& a, const std::vector<cab::Hit>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(cab::Hit)) == 0;
}

int main() {
  // quote
  cab::EngineDesc desc;  // thread_count is 1: the calling thread
  const std::vector<cab::Hit> one_thread = hits_of_crowd(desc);
  desc.thread_count = 0;  // every core
  const std::vector<cab::Hit> every_core = hits_of_crowd(desc);
  Jobs jobs;
  const cab::Scheduler scheduler = {&jobs, jobs.worker_count, Jobs::run};
  desc.scheduler = &scheduler;
  const std::vector<cab::Hit> own_threads = hits_of_crowd(desc);
  // end quote

  std::printf("%zu hits; %u tasks ran on the game's threads\n", one_thread.size(), jobs.tasks_run.load());
  const bool right = one_thread.size() == 32 * 31 && same(every_core, one_thread) && same(own_threads, one_thread);
  return right && jobs.tasks_run > 0 ? 0 : 1;
}
