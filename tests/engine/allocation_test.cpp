// Memory: a frame allocates nothing, an engine returns all that it took, and a failed allocation is a status.
#include "engine/session/engine.h"
#include "perf/harness/random_world.h"
#include "perf/judge/oracle/random_queries.h"
#include "tests/aligned_memory.h"
#include "tests/engine/counted_new.h"
#include "tests/engine/thread_pool.h"

#include <doctest/doctest.h>

#include <atomic>
#include <cstdlib>
#include <map>
#include <mutex>
#include <utility>

namespace {

using namespace cab;
using namespace cab::oracle;
using namespace cab::tests;

// A caller's allocator that counts, checks what is released, and fails on demand.
class Ledger {
 public:
  Allocator allocator() { return {this, allocate, release}; }
  std::uint64_t calls() const { return calls_; }
  bool balanced() const { return out_.empty() && wrong_releases_ == 0; }
  void fail_after(std::int64_t calls) { until_failure_ = calls; }

 private:
  static void* allocate(void* user, std::size_t bytes, std::size_t alignment) {
    Ledger& ledger = *static_cast<Ledger*>(user);
    const std::lock_guard lock(ledger.mutex_);
    ++ledger.calls_;
    if (ledger.until_failure_ == 0) return nullptr;
    if (ledger.until_failure_ > 0) --ledger.until_failure_;
    const std::int64_t countdown =
        std::exchange(news_until_failure(), -1);  // allocations of the ledger itself never fail
    void* const memory = allocate_aligned(bytes, alignment);
    std::memset(memory, 0xa5, bytes);
    ledger.out_[memory] = {bytes, alignment};
    news_until_failure() = countdown;
    return memory;
  }
  static void release(void* user, void* memory, std::size_t bytes, std::size_t alignment) {
    Ledger& ledger = *static_cast<Ledger*>(user);
    const std::lock_guard lock(ledger.mutex_);
    const auto found = ledger.out_.find(memory);
    if (found == ledger.out_.end() || found->second != std::pair(bytes, alignment)) {
      ++ledger.wrong_releases_;
      return;
    }
    ledger.out_.erase(found);
    free_aligned(memory);
  }

  std::mutex mutex_;
  std::map<void*, std::pair<std::size_t, std::size_t>> out_;
  std::uint64_t calls_ = 0;
  std::int64_t until_failure_ = -1;
  int wrong_releases_ = 0;
};

World mixed_world(std::uint64_t seed) {
  Random random(seed);
  World world;
  add_characters(random, world, 16);
  add_frames(random, world, 16);
  return world;
}

// Runs frames of a world with boxes alone and with the exact kernels, with contacts, and checks that nothing was
// allocated.
void check_no_allocation(Engine& engine, const World& world, const Ledger* ledger) {
  std::vector<BatchInput> inputs;
  for (std::uint32_t m = 0; m < world.members.size(); ++m) inputs.push_back(world.members[m].poses.input({m + 1}));
  std::vector<Hit> hits(200000);
  std::vector<Contact> contacts(hits.size());
  std::vector<Box> boxes(std::size_t{world.members[0].poses.instance_count} * world.members[0].rig.node_count());
  FrameJob job;
  job.inputs = inputs;
  job.rules = world.rules;
  job.hits = hits;
  for (const Refit refit : {Refit::kCab, Refit::kAabbHull}) {
    for (const auto& [strategy, exact] :
         {std::pair(Strategy::kTree, Exact::kNone), std::pair(Strategy::kBrute, Exact::kNone),
          std::pair(Strategy::kTree, Exact::kConvex), std::pair(Strategy::kBrute, Exact::kConvex)}) {
      for (const std::size_t capacity : {hits.size(), std::size_t{0}}) {
        job.policies = {refit, strategy, exact};
        job.hits.size = capacity;
        job.contacts = {contacts.data(), exact == Exact::kConvex ? capacity : 0};
        const std::uint64_t ledger_calls = ledger ? ledger->calls() : 0;
        const std::uint64_t news = new_calls, mallocs = malloc_calls;
        const Status status = run_frame(engine, job);
        const Status boxes_status = compute_boxes(engine, inputs[0], job.policies, boxes);
        const std::uint64_t news_after = new_calls, mallocs_after = malloc_calls;
        CHECK(status == (capacity ? Status::kOk : Status::kHitsOverflow));
        CHECK(boxes_status == Status::kOk);
        CHECK(news_after == news);
        CHECK(mallocs_after == mallocs);
        if (ledger) CHECK(ledger->calls() == ledger_calls);
      }
    }
  }
}

// A rig with hops and a rest pose. They add no ignored pair to those of the rig: its links are 100 apart at rest.
ArticulationDesc with_rest_pose(const Rig& rig, std::vector<float>& rest) {
  rest.clear();
  for (std::uint32_t link = 0; link < rig.link_count(); ++link)
    rest.insert(rest.end(), {0, 0, 0, 1, 100 * static_cast<float>(link), 0, 0});
  ArticulationDesc desc = rig.desc();
  desc.ignored_hops = 1;
  desc.rest_pose.data = rest.data();
  return desc;
}

}  // namespace

TEST_CASE("the counters count") {
  const std::uint64_t news = new_calls, mallocs = malloc_calls;
  int* volatile kept = new int(1);  // volatile: otherwise the compiler may remove the pair
  delete kept;
  CHECK(new_calls > news);
#if CAB_TEST_COUNTS_MALLOC
  CHECK(malloc_calls > mallocs);
#else
  CHECK(malloc_calls == mallocs);
#endif
}

TEST_CASE("a frame allocates nothing on the serial task runner, from its first on") {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    CAPTURE(seed);
    const World world = mixed_world(seed);
    Ledger ledger;
    const Allocator allocator = ledger.allocator();
    EngineDesc desc;
    desc.allocator = &allocator;
    const EnginePtr engine = make_engine_for(world, desc);
    check_no_allocation(*engine, world, &ledger);
    check_no_allocation(*make_engine_for(world), world, nullptr);
  }
}

TEST_CASE("a frame allocates nothing on a caller's scheduler, and nothing of the engine's on TBB") {
  const World world = mixed_world(5);
  ThreadPool pool(4);
  const Scheduler scheduler = pool.scheduler();
  Ledger ledger;
  const Allocator allocator = ledger.allocator();
  EngineDesc desc;
  desc.allocator = &allocator;
  desc.scheduler = &scheduler;
  check_no_allocation(*make_engine_for(world, desc), world, &ledger);

  desc.scheduler = nullptr;
  desc.thread_count = 4;
  const EnginePtr engine = make_engine_for(world, desc);
  const std::uint64_t calls = ledger.calls();
  run_on(*engine, world, {});
  CHECK(ledger.calls() == calls);
}

TEST_CASE("queries allocate nothing, from the first on, by boxes or shapes, with enough room for hits or not") {
  ThreadPool pool(3);
  const Scheduler scheduler = pool.scheduler();
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    CAPTURE(seed);
    Random random(seed);
    World world;
    add_characters(random, world, 12);
    KeptParts kept;
    for (Member& member : world.members) add_parts(random, member.rig, kept);
    std::vector<BatchInput> inputs;
    QueryScene scene;
    for (std::uint32_t m = 0; m < world.members.size(); ++m) {
      const Member& member = world.members[m];
      inputs.push_back(member.poses.input({m + 1}));
      for (std::uint32_t i = 0; i < member.poses.instance_count; ++i)
        scene.push_back(query_instance({m + 1}, member.rig, member.poses, i));
    }
    RandomQueries about;
    add_queries(random, scene, 200, about);
    std::vector<QueryHit> hits(100000);
    std::vector<std::uint8_t> found(about.queries.size());
    for (const bool threads : {false, true}) {
      CAPTURE(threads);
      Ledger ledger;
      const Allocator allocator = ledger.allocator();
      EngineDesc desc;
      desc.allocator = &allocator;
      if (threads) desc.scheduler = &scheduler;
      const EnginePtr engine = make_engine_for(world, desc);
      REQUIRE(reserve(*engine, {0, 0, 64}) == Status::kOk);
      const std::uint64_t ledger_calls = ledger.calls();
      for (const Exact exact : {Exact::kNone, Exact::kConvex})
        for (const std::size_t capacity : {hits.size(), std::size_t{0}}) {
          QueryJob job;
          job.inputs = inputs;
          job.queries = about.queries;
          job.planes = about.planes;
          job.exact = exact;
          job.hits = {hits.data(), capacity};
          job.found = found;
          const std::uint64_t news = new_calls, mallocs = malloc_calls;
          all_news_fail = true;
          const Status status = run_queries(*engine, job);
          all_news_fail = false;
          const std::uint64_t news_after = new_calls, mallocs_after = malloc_calls;
          CHECK(status == (capacity ? Status::kOk : Status::kHitsOverflow));
          CHECK(job.hits_needed > 0);
          CHECK(news_after == news);
          CHECK(mallocs_after == mallocs);
        }
      CHECK(ledger.calls() == ledger_calls);
    }
  }
}

TEST_CASE("a frame does not ask an allocator that would fail") {
  const World world = mixed_world(6);
  Ledger ledger;
  const Allocator allocator = ledger.allocator();
  EngineDesc desc;
  desc.allocator = &allocator;
  const EnginePtr engine = make_engine_for(world, desc);
  const Outcome expected = run_on(*engine, world, {});
  ledger.fail_after(0);
  CHECK(same_hits(run_on(*engine, world, {}).hits, expected.hits));
}

TEST_CASE(
    "with no memory left after its first frame an engine goes on, whatever is asked of it and however much touches") {
  Random random(10);
  World world = mixed_world(10);
  // More hits than the store begins with, and more hits of one character than a block holds.
  const auto giant = static_cast<std::uint32_t>(world.members.size() + 1), crowd = giant + 1, many = giant + 2;
  world.members.push_back(any_member(random, 1, BatchKind::kCharacters, {1, false, true, {}}, 2));
  for (Leaf& leaf : world.members.back().rig.leaves) std::fill_n(leaf.box.half, 3, 100.0f);
  world.members.push_back(any_member(random, 60, BatchKind::kCharacters, {0.2, true, true, {}}, 12));
  world.members.push_back(any_member(random, 4500, BatchKind::kCharacters, {40, false, true, {}}, 2));
  world.rules.push_back({{giant}, {crowd}, Pairing::kBetween});
  world.rules.push_back({{giant}, {many}, Pairing::kBetween});
  world.rules.push_back({{crowd}, {crowd}, Pairing::kBetween});
  world.rules.push_back({{crowd}, {crowd}, Pairing::kWithin});
  std::vector<BatchInput> inputs;
  std::vector<std::vector<std::uint8_t>> in_contact;
  for (const Member& member : world.members) in_contact.emplace_back(member.poses.instance_count);
  for (std::uint32_t m = 0; m < world.members.size(); ++m) {
    inputs.push_back(world.members[m].poses.input({m + 1}));
    inputs.back().in_contact = in_contact[m];
  }
  std::vector<Hit> hits(2'000'000);
  ThreadPool pool(3);
  const Scheduler scheduler = pool.scheduler();
  for (const bool threads : {false, true}) {
    Ledger ledger;
    const Allocator allocator = ledger.allocator();
    EngineDesc desc;
    desc.allocator = &allocator;
    if (threads) desc.scheduler = &scheduler;
    const EnginePtr engine = make_engine_for(world, desc);
    ReserveDesc room;
    room.hits = static_cast<std::uint32_t>(hits.size());
    require(reserve(*engine, room));
    run_on(*engine, world, {});
    ledger.fail_after(0);
    const std::uint64_t ledger_calls = ledger.calls();
    for (const Strategy strategy :
         {Strategy::kTree, Strategy::kRows, Strategy::kLinks, Strategy::kBrute, Strategy::kAuto})
      for (const Refit refit : {Refit::kCab, Refit::kCovariance, Refit::kAabbHull, Refit::kAabbVertices})
        for (const Report report : {Report::kHits, Report::kInContact})
          for (const std::size_t capacity : {hits.size(), std::size_t{1000}}) {
            FrameJob job;
            job.inputs = inputs;
            job.rules = world.rules;
            job.policies = {refit, strategy, Exact::kNone};
            job.report = report;
            job.hits = {hits.data(), capacity};
            const std::uint64_t news = new_calls, mallocs = malloc_calls;
            all_news_fail = true;
            const Status status = run_frame(*engine, job);
            all_news_fail = false;
            const std::uint64_t news_after = new_calls, mallocs_after = malloc_calls;
            const bool overflows = report == Report::kHits && capacity < hits.size();
            CHECK(status == (overflows ? Status::kHitsOverflow : Status::kOk));
            if (report == Report::kHits) CHECK(job.hits_needed > 20'000);
            CHECK(news_after == news);
            CHECK(mallocs_after == mallocs);
          }
    CHECK(ledger.calls() == ledger_calls);
  }
}

TEST_CASE("an allocator that fails at any call of an add gives kOutOfMemory, and the engine goes on") {
  const World world = mixed_world(7);
  const Outcome expected = run_world(world);
  Ledger ledger;
  const Allocator allocator = ledger.allocator();
  {
    EngineDesc desc;
    desc.allocator = &allocator;
    const EnginePtr engine = make_engine(desc);
    std::uint32_t expected_id = 0;
    int failures = 0;
    for (const Member& member : world.members) {
      ++expected_id;
      ArticulationId articulation = {99};
      BatchId batch = {99};
      const auto until_it_works = [&](auto&& add, std::uint64_t& id) {
        for (std::int64_t k = 0;; ++k) {
          REQUIRE(k < 1000);
          ledger.fail_after(k);
          const Status status = add();
          ledger.fail_after(-1);
          if (status == Status::kOk) break;
          CHECK(status == Status::kOutOfMemory);
          CHECK(id == 99);
          ++failures;
        }
        CHECK(static_cast<std::uint32_t>(id) == expected_id);  // the slot
      };
      std::vector<float> rest;
      const ArticulationDesc masked = with_rest_pose(member.rig, rest);
      until_it_works([&] { return add_articulation(*engine, masked, &articulation); }, articulation.value);
      until_it_works(
          [&] {
            return add_batch(*engine, {articulation, member.poses.instance_count, member.kind}, &batch);
          },
          batch.value);
    }
    CHECK(failures > 40);
    CHECK(same_hits(run_on(*engine, world, {}).hits, expected.hits));
  }
  CHECK(ledger.balanced());
}

TEST_CASE("operator new that fails at any call of a create or an add gives kOutOfMemory, and nothing leaks") {
  const World world = mixed_world(8);
  const Outcome expected = run_world(world);
  Ledger ledger;
  const Allocator allocator = ledger.allocator();
  EngineDesc desc;
  desc.allocator = &allocator;
  const auto until_it_works = [&](auto&& call) {
    int failures = 0;
    for (std::int64_t k = 0;; ++k) {
      fail_new_after(k);
      const Status status = call();
      fail_new_after(-1);
      if (status == Status::kOk) return failures;
      CHECK(status == Status::kOutOfMemory);
      REQUIRE(++failures < 100000);
    }
  };
  {
    Engine* made = nullptr;
    CHECK(until_it_works([&] { return create_engine(desc, &made); }) > 2);
    const EnginePtr engine(made);
    for (const Member& member : world.members) {
      ArticulationId articulation;
      BatchId batch;
      std::vector<float> rest;
      const ArticulationDesc masked = with_rest_pose(member.rig, rest);
      CHECK(until_it_works([&] { return add_articulation(*engine, masked, &articulation); }) > 2);
      CHECK(until_it_works([&] {
              return add_batch(*engine, {articulation, member.poses.instance_count, member.kind}, &batch);
            }) > 1);
    }
    CHECK(same_hits(run_on(*engine, world, {}).hits, expected.hits));
  }
  CHECK(ledger.balanced());
}

TEST_CASE("destroying an engine gives everything back, after frames and after refused adds") {
  const World world = mixed_world(9);
  Ledger ledger;
  const Allocator allocator = ledger.allocator();
  {
    EngineDesc desc;
    desc.allocator = &allocator;
    const EnginePtr engine = make_engine_for(world, desc);
    run_on(*engine, world, {});
    Rig bad = world.members[0].rig;
    bad.leaves.back().box.half[0] = -1;
    ArticulationId id;
    CHECK(add_articulation(*engine, bad.desc(), &id) == Status::kBadLeafBox);
    BatchId batch;
    CHECK(add_batch(*engine, {{1}, kMaxInstances + 1, BatchKind::kCharacters}, &batch) == Status::kTooManyInstances);
    CHECK(ledger.calls() > 0);
  }
  CHECK(ledger.balanced());
  destroy_engine(nullptr);
}
