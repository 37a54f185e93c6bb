// Profiler: phases lie within each other on each thread, every task is told, and frames stay as they are.
#include "perf/harness/random_world.h"
#include "tests/engine/thread_pool.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <map>
#include <mutex>
#include <set>
#include <string>
#include <thread>

namespace cab::tests {
namespace {

using namespace cab::oracle;

// What was told, by thread.
struct Told {
  std::mutex mutex;
  std::map<std::thread::id, std::vector<std::pair<std::string, std::uint32_t>>> open;
  std::map<std::string, std::size_t> count;
  std::set<std::uint32_t> workers;
  std::size_t out_of_order = 0;

  static void begin(void* user, const char* phase, std::uint32_t worker) {
    Told& told = *static_cast<Told*>(user);
    const std::lock_guard lock(told.mutex);
    told.open[std::this_thread::get_id()].emplace_back(phase, worker);
    ++told.count[phase];
    told.workers.insert(worker);
  }
  static void end(void* user, const char* phase, std::uint32_t worker) {
    Told& told = *static_cast<Told*>(user);
    const std::lock_guard lock(told.mutex);
    auto& open = told.open[std::this_thread::get_id()];
    if (open.empty() || open.back() != std::make_pair(std::string(phase), worker))
      ++told.out_of_order;
    else
      open.pop_back();
  }
  Profiler profiler() { return {this, begin, end}; }
  bool all_closed() const {
    return std::all_of(open.begin(), open.end(), [](const auto& thread) { return thread.second.empty(); });
  }
};

World any_world(Random& random) {
  World world;
  add_characters(random, world, 12);
  add_frames(random, world, 8);
  return world;
}

}  // namespace

TEST_CASE("a profiler is told of frames and their tasks, in pairs, and changes nothing") {
  ThreadPool pool(4);
  const Scheduler scheduler = pool.scheduler();
  for (std::uint64_t seed = 1; seed <= rounds(10); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    const World world = any_world(random);
    Told told;
    const Profiler profiler = told.profiler();
    EngineDesc desc;
    desc.profiler = &profiler;
    if (seed % 2) desc.scheduler = &scheduler;
    const EnginePtr engine = make_engine_for(world, desc);
    const Outcome found = run_on(*engine, world, {});
    CHECK(same_hits(found.hits, run_world(world).hits));
    CHECK(told.out_of_order == 0);
    CHECK(told.all_closed());
    CHECK(told.count["frame"] >= 1);
    CHECK(*told.workers.rbegin() < engine_thread_count(*engine));
    for (const char* phase : {"bound", "pair", "sequences"}) {
      CAPTURE(phase);
      CHECK(told.count[phase] >= 1);
    }
  }
}

TEST_CASE("a profiler is told of queries and of the tasks that the caller runs") {
  Random random(4);
  World world;
  add_characters(random, world, 12);
  Told told;
  const Profiler profiler = told.profiler();
  ThreadPool pool(4);
  const Scheduler scheduler = pool.scheduler();
  EngineDesc desc;
  desc.profiler = &profiler;
  desc.scheduler = &scheduler;
  const EnginePtr engine = make_engine_for(world, desc);
  std::vector<BatchInput> inputs;
  for (std::size_t m = 0; m < world.members.size(); ++m)
    inputs.push_back(world.members[m].poses.input({static_cast<std::uint32_t>(m + 1)}));
  FrameJob job;
  job.inputs = inputs;
  REQUIRE(begin_frame(*engine, job) == Status::kOk);
  std::uint32_t count = 0, tasks = 0;
  std::set<std::uint32_t> workers;
  while (next_tasks(*engine, &count) == Status::kOk && count > 0)
    for (std::uint32_t task = 0; task < count; ++task, ++tasks) {
      workers.insert(3 - tasks % 4);
      REQUIRE(run_task(*engine, task, 3 - tasks % 4) == Status::kOk);
    }
  REQUIRE(end_frame(*engine) == Status::kOk);
  std::size_t told_tasks = 0;
  for (const auto& phase : told.count) told_tasks += phase.second;
  CHECK(tasks > 0);
  CHECK(told_tasks == tasks);
  CHECK(workers.size() > 1);
  CHECK(told.workers == workers);

  REQUIRE(reserve(*engine, {0, 0, 4}) == Status::kOk);
  Query ray;
  ray.direction[0] = 1;
  ray.length = 10;
  ray.want = QueryWant::kAny;
  QueryJob asked;
  asked.inputs = inputs;
  asked.queries = {&ray, 1};
  REQUIRE(run_queries(*engine, asked) == Status::kOk);
  CHECK(told.count["queries"] == 1);
  CHECK(told.out_of_order == 0);
  CHECK(told.all_closed());
}

TEST_CASE("a profiler without one of its functions is refused") {
  Told told;
  Engine* engine = nullptr;
  EngineDesc desc;
  Profiler profiler = told.profiler();
  desc.profiler = &profiler;
  profiler.end = nullptr;
  CHECK(create_engine(desc, &engine) == Status::kBadProfiler);
  profiler = told.profiler();
  profiler.begin = nullptr;
  CHECK(create_engine(desc, &engine) == Status::kBadProfiler);
}

}  // namespace cab::tests
