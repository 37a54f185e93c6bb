// Task runners: every task runs once, and no two running tasks share a worker. Frames are the same on every instruction
// set and thread count.
#include "engine/step/task_runner.h"

#include "engine/session/engine.h"
#include "engine/step/task_roll.h"
#include "perf/harness/random_world.h"
#include "tests/engine/thread_pool.h"
#include "tests/sanitizers.h"

#include <doctest/doctest.h>

#include <atomic>
#include <fstream>
#include <functional>
#include <thread>

#if defined(__x86_64__)
#include <xmmintrin.h>
#endif

namespace {

using namespace cab;
using namespace cab::oracle;
using namespace cab::tests;

// Runs tasks that count their runs and check that no other task has their worker.
void check_task_runner(TaskRunner& runner, std::uint32_t task_count) {
  CAPTURE(task_count);
  const std::uint32_t workers = runner.worker_count();
  REQUIRE(workers > 0);
  std::vector<std::atomic<int>> runs(task_count);
  std::vector<std::atomic<int>> on_worker(workers);
  std::atomic<int> bad_workers{0}, shared_workers{0};
  runner.for_each(task_count, [&](std::uint32_t task, std::uint32_t worker) {
    ++runs[task];
    if (worker >= workers) {
      ++bad_workers;
      return;
    }
    if (++on_worker[worker] != 1) ++shared_workers;
    volatile double spin = 1;
    for (int i = 0; i < 200; ++i) spin = spin * 1.0000001;
    --on_worker[worker];
  });
  CHECK(bad_workers == 0);
  CHECK(shared_workers == 0);
  for (std::uint32_t t = 0; t < task_count; ++t) CHECK(runs[t] == 1);
}

void check_task_runner(TaskRunner& runner) {
  for (const std::uint32_t tasks : {0u, 1u, 2u, 7u, 1000u}) check_task_runner(runner, tasks);
}

}  // namespace

TEST_CASE("the serial task runner runs every task once, in order, on worker 0") {
  const auto runner = make_serial_task_runner();
  CHECK(runner->worker_count() == 1);
  check_task_runner(*runner);
  std::vector<std::uint32_t> order;
  runner->for_each(5, [&](std::uint32_t task, std::uint32_t) { order.push_back(task); });
  CHECK(order == std::vector<std::uint32_t>{0, 1, 2, 3, 4});
}

TEST_CASE("the TBB task runner runs every task once, on workers that no other task has") {
  for (const std::uint32_t threads : {0u, 1u, 2u, 8u}) {
    CAPTURE(threads);
    const auto runner = make_tbb_task_runner(threads);
    const std::uint32_t cores = make_tbb_task_runner(0)->worker_count();
    CHECK(runner->worker_count() == (threads == 0 ? cores : std::min(threads, cores)));
    for (int round = 0; round < 5; ++round) check_task_runner(*runner);
  }
}

#if defined(__linux__)

TEST_CASE("TBB task runners that come and go leave no memory behind") {
  if (!has_tbb()) {
    MESSAGE("skipped: this build lacks TBB");
    return;
  }
  if (kThreadSanitizer) {
    MESSAGE("skipped: what ThreadSanitizer keeps of each thread counts as resident too");
    return;
  }
  const auto resident_bytes = [] {
    std::size_t size = 0, resident = 0;
    std::ifstream("/proc/self/statm") >> size >> resident;
    return 4096 * resident;
  };
  const auto live = [](int count) {
    for (int i = 0; i < count; ++i) {
      const auto first = make_tbb_task_runner(2), second = make_tbb_task_runner(2);
      std::atomic<int> runs{0};
      for (const auto& runner : {first.get(), second.get()})
        runner->for_each(4, [&](std::uint32_t, std::uint32_t) { ++runs; });
      CHECK(runs == 8);
    }
  };
  live(200);
  const std::size_t before = resident_bytes();
  live(4000);
  const std::size_t after = resident_bytes();
  CHECK(after < before + 8'000'000);  // an arena for each was 5 to 9 kB: 40 to 72 MB
}

#endif  // __linux__

TEST_CASE("a caller's task runner is run as it is given, and not asked when there is nothing to do") {
  ThreadPool pool(4);
  const auto runner = make_caller_task_runner(pool.scheduler());
  CHECK(runner->worker_count() == 4);
  for (int round = 0; round < 5; ++round) check_task_runner(*runner);
  CHECK(pool.tasks_run() == 5 * 1010);
  const auto never = make_caller_task_runner(
      {nullptr, 1, [](void*, std::uint32_t, void (*)(void*, std::uint32_t, std::uint32_t), void*) { std::abort(); }});
  never->for_each(0, [](std::uint32_t, std::uint32_t) {});
}

TEST_CASE("a caller's scheduler gets all tasks, in goes of as many as a roll has") {
  struct Goes {
    std::vector<std::uint32_t> counts;
    static void parallel_for(void* user, std::uint32_t count, void (*task)(void*, std::uint32_t, std::uint32_t),
                             void* context) {
      static_cast<Goes*>(user)->counts.push_back(count);
      for (std::uint32_t t = 0; t < count; ++t) task(context, t, 0);
    }
  } goes;
  const auto runner = make_caller_task_runner({&goes, 1, Goes::parallel_for});
  std::vector<std::uint32_t> runs(TaskRoll::kMostTasks + 5, 0);
  runner->for_each(TaskRoll::kMostTasks + 5, [&](std::uint32_t task, std::uint32_t) { ++runs[task]; });
  CHECK(runs == std::vector<std::uint32_t>(TaskRoll::kMostTasks + 5, 1));
  CHECK(goes.counts == std::vector<std::uint32_t>{TaskRoll::kMostTasks, 5});
}

namespace {

// A scheduler of two workers that breaks its promise in one call of parallel_for.
struct BrokenPool {
  using Task = void (*)(void*, std::uint32_t, std::uint32_t);
  enum Fault { kNone, kSkips, kSkipsAll, kRepeats, kInvents, kNoSuchWorker, kReturnsEarly, kFaultCount };

  Fault fault = kNone;
  int calls = 0, broken_call = 0;
  std::vector<std::thread> late;

  static void parallel_for(void* user, std::uint32_t count, Task task, void* context) {
    BrokenPool& self = *static_cast<BrokenPool*>(user);
    const Fault now = self.calls++ == self.broken_call ? self.fault : kNone;
    for (std::uint32_t t = 0; t < count; ++t) {
      if (now == kSkipsAll || (now == kSkips && t == count / 2)) continue;
      if (now == kReturnsEarly && t % 2 == 1)
        self.late.emplace_back([=] { task(context, t, 1); });
      else
        task(context, t, 0);
    }
    if (now == kRepeats) task(context, count / 2, 1);
    if (now == kInvents) task(context, count + 3, 0), task(context, ~0u, 1);
    if (now == kNoSuchWorker) task(context, 0, 77);
  }

  Scheduler scheduler() { return {this, 2, parallel_for}; }

  // Breaks the call of parallel_for of this number from now on.
  void break_call(Fault what, int call) {
    fault = what;
    calls = 0;
    broken_call = call;
  }
  void repair() {
    for (std::thread& thread : late) thread.join();
    late.clear();
    fault = kNone;
  }
};

// Cubes in a long row, each touching the next.
World row_of_cubes(std::uint32_t count) {
  World world;
  Member member;
  member.rig.parents = {-1};
  member.rig.leaves = {{0, {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0.5f, 0.5f, 0.5f}}, {}}};
  member.poses.link_count = 1;
  member.poses.instance_count = count;
  for (std::uint32_t i = 0; i < count; ++i) {
    member.poses.data.insert(member.poses.data.end(), {0, 0, 0, 1, 0, 0, 0});
    member.poses.origins.insert(member.poses.origins.end(), {0.75 * i, 0, 0});
  }
  world.members = {member};
  world.rules = {{{1}, {1}, Pairing::kBetween}};
  return world;
}

bool is_broken(Status status) { return status == Status::kBadTask || status == Status::kTasksLeft; }

}  // namespace

TEST_CASE(
    "a frame whose tasks the caller's scheduler skips, repeats or invents answers a status, and the next is right") {
  for (const bool by_words : {false, true}) {
    const std::uint32_t count = by_words ? 1100 : 40;
    const World world = row_of_cubes(count);
    const std::vector<Hit> expected = run_world(world).hits;
    REQUIRE(expected.size() == count - 1);
    BrokenPool pool;
    const Scheduler scheduler = pool.scheduler();
    EngineDesc desc;
    desc.scheduler = &scheduler;
    const EnginePtr engine = make_engine_for(world, desc);
    for (int fault = BrokenPool::kSkips; fault < BrokenPool::kFaultCount; ++fault)
      for (int call = 0;; ++call) {
        CAPTURE(fault);
        CAPTURE(call);
        const Policies policies = {Refit::kCab, by_words ? Strategy::kRows : Strategy::kTree,
                                   by_words ? Exact::kNone : Exact::kConvex};
        std::vector<Hit> hits(expected.size());
        const BatchInput input = world.members[0].poses.input({1});
        FrameJob job;
        job.inputs = {&input, 1};
        job.rules = world.rules;
        job.policies = policies;
        job.hits = hits;
        pool.break_call(static_cast<BrokenPool::Fault>(fault), call);
        const Status status = run_frame(*engine, job);
        const int calls = pool.calls;
        pool.repair();
        // Late tasks may all have ended by chance.
        const bool may_be_whole = fault == BrokenPool::kReturnsEarly;
        CHECK((is_broken(status) == (call < calls) || (may_be_whole && status == Status::kOk)));
        if (status == Status::kOk) CHECK(same_hits(hits, expected));
        REQUIRE(run_frame(*engine, job) == Status::kOk);
        CHECK(same_hits(hits, expected));
        if (call >= calls) break;
      }
  }
}

TEST_CASE("every other call whose tasks a scheduler skips answers a status too, and works the next time") {
  const World world = row_of_cubes(1100);
  BrokenPool pool;
  const Scheduler scheduler = pool.scheduler();
  EngineDesc desc;
  desc.scheduler = &scheduler;
  const EnginePtr engine = make_engine_for(world, desc);
  ReserveDesc room;
  room.queries = 8;
  require(reserve(*engine, room));
  HistoryDesc of;
  of.batch = {1};
  of.ticks = 2;
  HistoryId history;
  require(add_history(*engine, of, &history));
  const std::vector<Hit> hits = run_world(world).hits;
  std::vector<float> bounds;
  for (int i = 0; i < 1100; ++i) bounds.insert(bounds.end(), {-0.51f, -0.51f, -0.51f, 0.51f, 0.51f, 0.51f});
  BatchInput input = world.members[0].poses.input({1});
  input.bounds = bounds;
  std::vector<float> numbers(hits.size() + 1);
  std::vector<Contact> contacts(hits.size());
  double time = 0;
  const std::function<Status()> calls[] = {
      [&] {
        std::vector<InstancePair> pairs(hits.size());
        FrameJob job;
        job.inputs = {&input, 1};
        job.rules = world.rules;
        CandidateList list;
        list.pairs = pairs;
        const Status status = find_candidates(*engine, job, list);
        CHECK(list.pair_count == (status == Status::kOk ? hits.size() : 0));
        return status;
      },
      [&] {
        Query query;
        query.kind = QueryKind::kRegion;
        QueryJob job;
        job.inputs = {&input, 1};
        job.queries = {&query, 1};
        std::uint8_t found = 7;
        job.found = {&found, 1};
        query.want = QueryWant::kAny;
        return run_queries(*engine, job);
      },
      [&] {
        return compute_contacts(*engine, {&input, 1}, hits, contacts);
      },
      [&] { return sweep_margins(*engine, input, input, numbers); },
      [&] {
        return find_touching_moments(*engine, {&input, 1}, {&input, 1}, 0.01f, hits, numbers);
      },
      [&] {
        const Status status = record_tick(*engine, history, input, time);
        if (status == Status::kOk) ++time;
        return status;
      }};
  for (const auto& call : calls)
    for (const BrokenPool::Fault fault : {BrokenPool::kSkips, BrokenPool::kRepeats}) {
      pool.break_call(fault, 0);
      CHECK(call() == (fault == BrokenPool::kSkips ? Status::kTasksLeft : Status::kBadTask));
      pool.repair();
      CHECK(call() == Status::kOk);
    }
  HistorySpan span;
  require(history_span(*engine, history, &span));
  CHECK(span.last == time - 1);
}

#if defined(__x86_64__)

TEST_CASE("a caller's threads run every task in the library's floating-point mode, and keep their own") {
  constexpr unsigned kOurs = 0x1f80, kNotSticky = ~0x3fu;
  // Round up, flush to zero, denormals are zero; then traps for invalid operations and division by zero.
  for (const unsigned theirs : {0xdfc0u, 0x1d00u}) {
    CAPTURE(theirs);
    const unsigned before = _mm_getcsr();
    std::atomic<int> wrong{0}, changed{0};
    ThreadPool pool(
        4, [theirs] { _mm_setcsr(theirs); }, [&] { changed += (_mm_getcsr() & kNotSticky) != theirs; });
    make_caller_task_runner(pool.scheduler())->for_each(100, [&](std::uint32_t, std::uint32_t) {
      wrong += (_mm_getcsr() & kNotSticky) != kOurs;
    });
    _mm_setcsr(before);
    CHECK(pool.tasks_run() == 100);
    CHECK(wrong == 0);
    CHECK(changed == 0);
  }
}

#endif  // __x86_64__

TEST_CASE("hits and counts of a frame are the same on every instruction set and any number of threads") {
  for (std::uint64_t seed = 100; seed < 108; ++seed) {
    CAPTURE(seed);
    Random random(seed);
    World world;
    add_characters(random, world, 24);
    add_frames(random, world, 24);
    for (const Refit refit : {Refit::kCab, Refit::kAabbHull}) {
      for (const Strategy strategy : {Strategy::kTree, Strategy::kBrute}) {
        const Policies policies = {refit, strategy, Exact::kNone};
        EngineDesc desc;
        desc.isa = Isa::kScalar;
        const Outcome expected = run_world(world, policies, desc);
        const auto check_same = [&](const EngineDesc& other) {
          const Outcome got = run_world(world, policies, other);
          CHECK(same_hits(expected.hits, got.hits));
          CHECK(same_counts(expected.stats, got.stats));
        };
        for (const Isa isa : available_isas()) {
          CAPTURE(to_string(isa));
          desc = {};
          desc.isa = isa;
          check_same(desc);
        }
        for (const std::uint32_t threads : {0u, 2u, 4u, 8u}) {
          CAPTURE(threads);
          desc = {};
          desc.thread_count = threads;
          check_same(desc);
        }
        for (const std::uint32_t workers : {1u, 2u, 4u, 8u}) {
          CAPTURE(workers);
          ThreadPool pool(workers);
          const Scheduler scheduler = pool.scheduler();
          desc = {};
          desc.scheduler = &scheduler;
          check_same(desc);
          CHECK(pool.tasks_run() > 0);
        }
      }
    }
  }
}

TEST_CASE("splitting the instances of a batch into several batches changes no hit") {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    CAPTURE(seed);
    Random random(seed);
    World whole;
    const PoseRange range = any_pose_range(random, seed % 2 == 0, {{3e8, -2e6, 5e3}}, 1.0);
    whole.members.push_back(any_member(random, 33, BatchKind::kCharacters, range, 16));
    whole.rules = {{{1}, {1}, Pairing::kBetween}, {{1}, {1}, Pairing::kWithin}};
    const Member& member = whole.members[0];

    World parts;
    const std::uint32_t begin[] = {0, 5, 22, 33};
    for (std::uint32_t p = 0; p < 3; ++p) {
      Member part = member;
      const auto slice = [&](auto& values) {
        const std::size_t each = values.size() / 33;
        values.assign(values.begin() + static_cast<std::ptrdiff_t>(each * begin[p]),
                      values.begin() + static_cast<std::ptrdiff_t>(each * begin[p + 1]));
      };
      slice(part.poses.data = member.poses.data);
      slice(part.poses.origins = member.poses.origins);
      slice(part.poses.orientations = member.poses.orientations);
      part.poses.instance_count = begin[p + 1] - begin[p];
      parts.members.push_back(part);
    }
    pair_all(parts, 1, 3);
    for (const Strategy strategy : {Strategy::kTree, Strategy::kRows, Strategy::kLinks}) {
      const Policies policies = {Refit::kCab, strategy};
      Outcome of_parts = run_world(parts, policies);
      for (Hit& hit : of_parts.hits) {
        hit.instance_a += begin[hit.batch_a.value - 1];
        hit.instance_b += begin[hit.batch_b.value - 1];
        hit.batch_a = hit.batch_b = {1};
      }
      std::sort(of_parts.hits.begin(), of_parts.hits.end(), link_less);
      const Outcome of_whole = run_world(whole, policies);
      CHECK(of_whole.hits.size() > 0);
      CHECK(same_hits(of_whole.hits, of_parts.hits));
      CHECK(same_counts(of_whole.stats, of_parts.stats));
    }
  }
}
