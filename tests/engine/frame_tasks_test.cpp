// begin_frame, next_tasks, run_task and end_frame: frames whose tasks the caller runs.
#include "engine/session/engine.h"
#include "engine/step/task_roll.h"

#include "perf/harness/random_world.h"
#include "perf/harness/world.h"
#include "tests/engine/small_store.h"
#include "tests/engine/thread_pool.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <numeric>

namespace cab::tests {
namespace {

using namespace cab::oracle;

// How the tasks of a step are run.
enum class Way { kAscending, kRandomOrder, kRandomThreads, kTbb };

struct StepRunner {
  Way way = Way::kAscending;
  Random random{1};
  ThreadPool* pool = nullptr;
  std::uint64_t tasks = 0, steps = 0;

  void run(Engine& engine, std::uint32_t count) {
    tasks += count;
    ++steps;
    std::vector<std::uint32_t> order(count);
    std::iota(order.begin(), order.end(), 0u);
    if (way != Way::kAscending)
      for (std::size_t left = count; left > 1; --left)
        std::swap(order[left - 1], order[random.index(static_cast<std::uint32_t>(left))]);
    struct Step {
      Engine& engine;
      const std::vector<std::uint32_t>& order;
      std::atomic<int> failed{0};
    } step = {engine, order};
    const auto one = [](void* context, std::uint32_t t, std::uint32_t worker) {
      Step& of = *static_cast<Step*>(context);
      of.failed += run_task(of.engine, of.order[t], worker) != Status::kOk;
    };
    if (way == Way::kTbb) {
      make_tbb_task_runner(engine_thread_count(engine))->for_each(count, [&](std::uint32_t t, std::uint32_t worker) {
        one(&step, t, worker);
      });
    } else if (way == Way::kRandomThreads) {
      const Scheduler scheduler = pool->scheduler();
      scheduler.parallel_for(scheduler.user, count, one, &step);
    } else {
      for (std::uint32_t t = 0; t < count; ++t) one(&step, t, random.index(engine_thread_count(engine)));
    }
    REQUIRE(step.failed == 0);
  }
};

StepRunner* runner = nullptr;  // of run_by_tasks, which has the type of run_frame

Status run_by_tasks(Engine& engine, FrameJob& job) noexcept {
  Status status = begin_frame(engine, job);
  if (status != Status::kOk) return status;
  std::uint32_t count = 0;
  while ((status = next_tasks(engine, &count)) == Status::kOk && count > 0) runner->run(engine, count);
  if (status != Status::kOk) return status;
  return end_frame(engine);
}

World any_world(Random& random) {
  World world;
  add_characters(random, world, 12);
  if (random.chance(0.5)) add_frames(random, world, 12);
  if (random.chance(0.5)) add_layers(random, world);
  return world;
}

void check_same(const Outcome& found, const Outcome& expected, bool counts) {
  CHECK(same_hits(found.hits, expected.hits));
  CHECK(found.flags == expected.flags);
  CHECK(found.in_contact == expected.in_contact);
  CHECK(found.contacts.size() == expected.contacts.size());
  static_assert(sizeof(Contact) == 44, "no padding to compare");
  if (!found.contacts.empty() && found.contacts.size() == expected.contacts.size())
    CHECK(std::memcmp(found.contacts.data(), expected.contacts.data(), found.contacts.size() * sizeof(Contact)) == 0);
  if (!counts) return;
  CHECK(found.stats.candidates == expected.stats.candidates);
  CHECK(same_counts(found.stats, expected.stats));
}

}  // namespace

TEST_CASE("a frame whose tasks the caller runs is that of run_frame, in any order and on any threads") {
  ThreadPool pool(8);
  const Scheduler scheduler = pool.scheduler();
  std::size_t hits = 0;
  for (const Way way : {Way::kAscending, Way::kRandomOrder, Way::kRandomThreads, Way::kTbb}) {
    if (way == Way::kTbb && !build_info().tbb) {
      MESSAGE("skipped: this build lacks TBB");
      continue;
    }
    StepRunner steps;
    steps.way = way;
    steps.pool = &pool;
    runner = &steps;
    for (std::uint64_t seed = 1; seed <= rounds(40); ++seed) {
      CAPTURE(seed);
      CAPTURE(static_cast<int>(way));
      Random random(seed);
      const World world = any_world(random);
      Policies policies;
      policies.strategy = static_cast<Strategy>(random.index(policy_table()[1].value_count));
      if (random.chance(0.3)) policies.refit = Refit::kAabbHull;
      const bool exact = random.chance(0.4);
      if (exact) policies.exact = Exact::kConvex;
      World asked = world;
      if (exact) asked.contacts = random.chance(0.5);
      if (exact && random.chance(0.5)) asked.min_depth = 0.02f;
      asked.margin = random.chance(0.3) ? 0.05f : 0;
      Report report = static_cast<Report>(random.index(3));
      if (report == Report::kDistances && !(exact && asked.contacts)) report = Report::kHits;
      if (report == Report::kInContact) asked.contacts = false, asked.min_depth = 0;
      EngineDesc desc;
      desc.scheduler = &scheduler;
      const EnginePtr engine = make_engine_for(asked, desc), other = make_engine_for(asked);
      if (random.chance(0.3)) shrink_store(*engine);
      for (int frame = 0; frame < 2; ++frame) {
        const Outcome expected = run_on(*other, asked, policies, run_frame, report);
        const Outcome found = run_on(*engine, asked, policies, run_by_tasks, report);
        check_same(found, expected, report != Report::kInContact);
        check_same(run_on(*engine, asked, policies, run_frame, report), expected, report != Report::kInContact);
        hits += expected.hits.size();
      }
    }
    CHECK(steps.steps > 0);
    CHECK(steps.tasks > steps.steps);
  }
  CHECK(hits >= least_count(5000, 40));
}

namespace {

World small_world() {
  Random random(3);
  World world;
  world.members.push_back(any_member(random, 40, BatchKind::kCharacters, any_pose_range(random, false, {}, 1), 6));
  pair_all(world, 1, 1);
  return world;
}

}  // namespace

TEST_CASE("calls out of turn are refused, and a frame in progress keeps all other calls out") {
  const World world = small_world();
  const EnginePtr engine = make_engine_for(world);
  std::uint32_t count = 7;
  CHECK(next_tasks(*engine, &count) == Status::kNoFrame);
  CHECK(run_task(*engine, 0, 0) == Status::kNoFrame);
  CHECK(end_frame(*engine) == Status::kNoFrame);
  CHECK(count == 7);

  const BatchInput input = world.members[0].poses.input({1});
  FrameJob job;
  job.inputs = {&input, 1};
  job.rules = world.rules;
  job.margin = -1;
  CHECK(begin_frame(*engine, job) == Status::kBadMargin);
  CHECK(end_frame(*engine) == Status::kNoFrame);
  job.margin = 0;
  REQUIRE(begin_frame(*engine, job) == Status::kOk);
  FrameJob another = job;
  CHECK(begin_frame(*engine, another) == Status::kBusy);
  CHECK(run_frame(*engine, another) == Status::kBusy);
  CandidateList list;
  CHECK(find_candidates(*engine, job, list) == Status::kBusy);
  CHECK(remove_batch(*engine, {1}) == Status::kBusy);
  BatchId id;
  CHECK(add_batch(*engine, {{1}, 1}, &id) == Status::kBusy);
  CHECK(run_task(*engine, 0, 0) == Status::kBadTask);  // no step has begun
  CHECK(next_tasks(*engine, nullptr) == Status::kBadOutput);
  REQUIRE(next_tasks(*engine, &count) == Status::kOk);
  REQUIRE(count > 1);
  CHECK(next_tasks(*engine, &count) == Status::kTasksLeft);
  CHECK(run_task(*engine, count, 0) == Status::kBadTask);
  CHECK(run_task(*engine, 0, 1) == Status::kBadTask);
  CHECK(run_task(*engine, 0, 0) == Status::kOk);
  CHECK(end_frame(*engine) == Status::kTasksLeft);  // the frame is given up
  CHECK(end_frame(*engine) == Status::kNoFrame);
  CHECK(same_hits(run_on(*engine, world, {}).hits, run_world(world).hits));
}

TEST_CASE("a task that is run twice is refused, and the frame has all its hits") {
  const World world = small_world();
  const Outcome expected = run_world(world);
  const EnginePtr engine = make_engine_for(world);
  const BatchInput input = world.members[0].poses.input({1});
  std::vector<Hit> hits(expected.hits.size());
  FrameJob job;
  job.inputs = {&input, 1};
  job.rules = world.rules;
  job.hits = hits;
  REQUIRE(begin_frame(*engine, job) == Status::kOk);
  std::uint32_t count = 0;
  while (next_tasks(*engine, &count) == Status::kOk && count > 0)
    for (std::uint32_t t = 0; t < count; ++t) {
      CHECK(run_task(*engine, t, 0) == Status::kOk);
      CHECK(run_task(*engine, t, 0) == Status::kBadTask);
      CHECK(run_task(*engine, t, ~0u) == Status::kBadTask);
    }
  CHECK(end_frame(*engine) == Status::kOk);
  CHECK(same_hits(hits, expected.hits));
}

TEST_CASE("a step of more tasks than are given at a time is given in several goes") {
  // Two sequences, whose frames are tested sixteen at a time; the last two touch.
  constexpr std::uint32_t kFrames = kLanes * TaskRoll::kMostTasks + 2 * kLanes;
  World world;
  for (const double at : {0.0, 9.0}) {
    Member member;
    member.kind = BatchKind::kSequence;
    member.rig.parents = {-1};
    member.rig.leaves = {{0, {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {1, 1, 1}}, {}}};
    member.poses.link_count = 1;
    member.poses.instance_count = at == 0 ? 1 : kFrames;
    member.poses.data.resize(7 * std::size_t{member.poses.instance_count});
    for (std::uint32_t i = 0; i < member.poses.instance_count; ++i) {
      member.poses.pose(i, 0)[3] = 1;
      member.poses.pose(i, 0)[4] = static_cast<float>(i + 2 < kFrames ? at : 0);
    }
    world.members.push_back(std::move(member));
  }
  world.rules = {{{1}, {2}, Pairing::kBetween}};
  const EnginePtr engine = make_engine_for(world);
  const BatchInput inputs[] = {world.members[0].poses.input({1}), world.members[1].poses.input({2})};
  std::vector<Hit> hits(3);
  FrameJob job;
  job.inputs = inputs;
  job.rules = world.rules;
  job.hits = hits;
  REQUIRE(begin_frame(*engine, job) == Status::kOk);
  std::vector<std::uint32_t> counts;
  std::uint32_t count = 0, refused = 0;
  while (next_tasks(*engine, &count) == Status::kOk && count > 0) {
    counts.push_back(count);
    for (std::uint32_t t = 0; t < count; ++t) refused += run_task(*engine, t, 0) != Status::kOk;
  }
  CHECK(counts == std::vector<std::uint32_t>{TaskRoll::kMostTasks, 2});
  CHECK(refused == 0);
  CHECK(end_frame(*engine) == Status::kOk);
  CHECK(job.hit_count == 2);
}

TEST_CASE("a frame may be given up after any task, and its hits may not fit") {
  const World world = small_world();
  const Outcome expected = run_world(world);
  REQUIRE(expected.hits.size() > 2);
  const EnginePtr engine = make_engine_for(world);
  const BatchInput input = world.members[0].poses.input({1});
  std::vector<Hit> hits(expected.hits.size());
  FrameJob job;
  job.inputs = {&input, 1};
  job.rules = world.rules;
  job.hits = hits;
  for (std::uint32_t most = 0;; ++most) {
    REQUIRE(begin_frame(*engine, job) == Status::kOk);
    std::uint32_t left = most, count = 0;
    bool done = false;
    while (!done && next_tasks(*engine, &count) == Status::kOk) {
      for (std::uint32_t t = 0; t < count && left > 0; ++t, --left) REQUIRE(run_task(*engine, t, 0) == Status::kOk);
      done = count == 0 || left == 0;
    }
    const Status status = end_frame(*engine);
    CHECK(status == (count == 0 ? Status::kOk : Status::kTasksLeft));
    if (count == 0) break;
    CHECK(same_hits(run_on(*engine, world, {}).hits, expected.hits));
  }
  CHECK(same_hits(hits, expected.hits));
  job.hits.size = 2;
  StepRunner steps;
  runner = &steps;
  CHECK(run_by_tasks(*engine, job) == Status::kHitsOverflow);
  CHECK(job.hits_needed == expected.hits.size());
  CHECK(job.hit_count == 0);
}

TEST_CASE("an engine may be destroyed while a frame is in progress") {
  const World world = small_world();
  EnginePtr engine = make_engine_for(world);
  const BatchInput input = world.members[0].poses.input({1});
  FrameJob job;
  job.inputs = {&input, 1};
  REQUIRE(begin_frame(*engine, job) == Status::kOk);
  engine.reset();
  CHECK(engine == nullptr);
}

}  // namespace cab::tests
