// A frame as tasks of a game's own graph: no thread waits within the engine, and other work runs between the steps.
#include <cab/world.h>

#include <atomic>
#include <cstdio>
#include <thread>
#include <vector>

constexpr std::uint32_t kWorkers = 4;

// What a game's graph does with `count` tasks that may run at the same time, and with other work beside them. This
// example starts threads; a game has them. Each worker has a number of its own.
template <class Task>
static void run_all(std::uint32_t count, const Task& task) {
  std::atomic<std::uint32_t> next{0};
  const auto work = [&](std::uint32_t worker) {
    for (std::uint32_t t = next++; t < count; t = next++) task(t, worker);
  };
  std::vector<std::thread> threads;
  for (std::uint32_t worker = 1; worker < kWorkers; ++worker) threads.emplace_back(work, worker);
  work(0);
  for (std::thread& thread : threads) thread.join();
}

int main() {
  // quote
  // The engine starts no threads. It only needs to know how many workers there are.
  const auto never = [](void*, std::uint32_t, void (*)(void*, std::uint32_t, std::uint32_t), void*) {};
  const cab::Scheduler scheduler = {nullptr, kWorkers, never};
  cab::EngineDesc desc;
  desc.scheduler = &scheduler;
  cab::World world(desc);
  // end quote

  // 32 rows of 32 fighters. In a row they stand 1 apart and are 1.2 wide, so each touches the next one.
  constexpr std::uint32_t kCount = 32 * 32;
  const std::int32_t parents[] = {-1};
  const cab::Leaf leaf = {0, cab::axis_aligned_box({0, .9f, 0}, {.6f, .9f, .2f}), {}};
  cab::BatchId crowd;
  cab::exit_on_error(world.add_batch({parents, {}, {&leaf, 1}, {}}, kCount, &crowd));
  std::vector<float> poses;
  std::vector<double> origins;
  for (std::uint32_t i = 0; i < kCount; ++i) {
    poses.insert(poses.end(), {0, 0, 0, 1, 0, 0, 0});
    origins.insert(origins.end(), {1. * (i % 32), 0, 2. * (i / 32)});
  }

  // The job and all that it names stay as they are until end_frame.
  const cab::PairRule rule = {crowd, crowd};
  cab::BatchInput input;
  input.batch = crowd;
  input.poses.data = poses.data();
  input.origins = origins;
  std::vector<cab::Hit> hits(kCount);
  // quote
  cab::FrameJob job;
  job.inputs = {&input, 1};
  job.rules = {&rule, 1};
  job.hits = hits;

  cab::Engine& engine = world.engine();
  cab::exit_on_error(cab::begin_frame(engine, job));
  std::uint32_t steps = 0, count = 0;
  std::atomic<std::uint32_t> failures{0};
  for (;;) {
    cab::exit_on_error(cab::next_tasks(engine, &count));
    if (count == 0) break;
    ++steps;
    run_all(count, [&](std::uint32_t task, std::uint32_t worker) {
      if (cab::run_task(engine, task, worker) != cab::Status::kOk) ++failures;
    });
  }
  cab::exit_on_error(cab::end_frame(engine));  // what run_frame would answer, kHitsOverflow included
  // end quote

  std::printf("%zu hits after %u steps\n", job.hit_count, steps);
  return job.hit_count == 32 * 31 && steps > 0 && failures == 0 ? 0 : 1;
}
