// Calls of run_queries share the indexes of an engine: the first about a frame makes one, and others search it, on
// several threads with the same bits.
#include "engine/queries/query_indexes.h"
#include "engine/session/engine.h"
#include "perf/harness/random_world.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstring>
#include <memory>
#include <thread>
#include <vector>

namespace cab::tests {
namespace {

using namespace cab::oracle;

constexpr std::uint32_t kCharacters = 900;
constexpr std::size_t kPrice = kCharacters / 2;  // in rays, of an index that is halved

// Characters in a cube, of which a frame knows the bounds, and rays through them.
struct Crowd {
  World world;
  EnginePtr engine;
  std::vector<BatchInput> inputs;
  std::vector<Query> rays;

  Crowd(Random& random, std::size_t ray_count, std::uint32_t threads = 1) {
    Member& member = world.members.emplace_back();
    member.rig = any_rig(random, 12);
    PoseRange range;
    range.spread = 6;
    member.poses = random_poses(random, member.rig, kCharacters, PoseFormat::kQuaternionTranslation, range);
    EngineDesc desc;
    desc.thread_count = threads;
    engine = make_engine_for(world, desc);
    require(reserve(*engine, {0, 0, 64}));
    inputs = {member.poses.input({1})};
    for (std::size_t i = 0; i < ray_count; ++i) {
      Query& ray = rays.emplace_back();
      const Vec3<double> along = random.unit_vector();
      const double way[3] = {along[0], along[1], along[2]};
      for (std::size_t c = 0; c < 3; ++c) {
        ray.position[c] = random.uniform(-6, 6);
        ray.direction[c] = static_cast<float>(way[c]);
      }
      ray.length = 60;
    }
    next_frame();
  }

  void next_frame() {
    FrameJob frame;
    frame.inputs = inputs;
    require(run_frame(*engine, frame));
  }

  // Asks some of the rays.
  std::vector<QueryHit> ask(std::size_t first, std::size_t count, QueryJob job = {}) const {
    std::vector<QueryHit> hits(count);
    job.inputs = inputs;
    job.queries = {rays.data() + first, count};
    job.reuse_bounds = true;
    job.hits = hits;
    require(run_queries(*engine, job));
    hits.resize(job.hit_count);
    return hits;
  }

  QueryIndexes& indexes() const { return *engine->query_indexes; }

  IndexWanted wanted(std::size_t ray_count = 1) const {
    return {engine->bounds_of_frame, engine->stored_batches(), kCharacters, {rays.data(), ray_count}};
  }
};

bool same_hits(const std::vector<QueryHit>& a, const std::vector<QueryHit>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const QueryHit& x, const QueryHit& y) {
    return std::memcmp(&x, &y, offsetof(QueryHit, inside)) == 0 && x.inside == y.inside;
  });
}

// How many indexes were made for calls.
std::uint64_t made(const Crowd& crowd) { return crowd.indexes().serial; }

}  // namespace

TEST_CASE("indexes: what they take is part of the engine's memory") {
  Random random(96);
  Crowd crowd(random, 1);
  auto& all = crowd.indexes().all;
  std::size_t taken = 0;
  for (const auto& stored : all) taken += stored->arena.bytes();
  CHECK(taken > kCharacters * sizeof(InstanceBounds));
  EngineMemory with, without;
  require(engine_memory(*crowd.engine, &with));
  auto kept = std::move(all);
  all.clear();
  require(engine_memory(*crowd.engine, &without));
  all = std::move(kept);
  CHECK(with.queries - without.queries == taken);
  CHECK(with.total - without.total == taken);
}

TEST_CASE("indexes: one is made for a frame, and a better one when what was asked pays for it") {
  Random random(91);
  Crowd crowd(random, 2 * kPrice);
  crowd.ask(0, 1);
  CHECK(made(crowd) == 1);
  for (std::size_t i = 1; i < 100; ++i) crowd.ask(i, 1);
  crowd.ask(100, kPrice - 100);
  CHECK(made(crowd) == 1);
  CHECK(crowd.indexes().all[0]->index.arrangement == Arrangement::kOnCurve);
  crowd.ask(0, 1);
  CHECK(made(crowd) == 2);
  CHECK(crowd.indexes().all[0]->index.arrangement == Arrangement::kHalved);
  crowd.ask(0, 2 * kPrice);
  CHECK(made(crowd) == 2);
  crowd.next_frame();
  crowd.ask(0, 1);
  CHECK(made(crowd) == 3);
  CHECK(crowd.indexes().all[0]->index.arrangement == Arrangement::kOnCurve);
}

TEST_CASE("indexes: where the one that is wanted is being made, a worse one is searched, or one is made") {
  Random random(92);
  Crowd crowd(random, 2 * kPrice);
  QueryIndexes& indexes = crowd.indexes();
  for (int i = 0; i < 3; ++i) add_query_index(indexes, crowd.engine->sized, crowd.engine->allocator);
  std::vector<BatchInput> inputs = crowd.inputs;
  InstanceBatch& batch = crowd.engine->batches[0]->batch;  // as if it were bound
  batch.input = &inputs[0];
  auto first = std::make_unique<IndexLease>(indexes, crowd.wanted());
  CHECK(first->is_to_make());
  CHECK(first->index().arrangement == Arrangement::kOnCurve);
  {
    IndexLease beside(indexes, crowd.wanted());
    CHECK(beside.is_to_make());
    CHECK(&beside.index() != &first->index());
    // It is not finished, as if its call had failed, so nobody gets it.
  }
  first->finish();
  const QueryIndex* const made_first = &first->index();
  first.reset();
  {
    const IndexLease again(indexes, crowd.wanted());
    CHECK(!again.is_to_make());
    CHECK(&again.index() == made_first);
    // Of another frame, of a frame that is not known, or of other instances.
    IndexWanted other = crowd.wanted();
    ++other.of_frame;
    CHECK(IndexLease(indexes, other).is_to_make());
    other.of_frame = 0;
    CHECK(IndexLease(indexes, other).is_to_make());
    batch.instance_count = 5;
    CHECK(IndexLease(indexes, crowd.wanted()).is_to_make());
    batch.instance_count = kCharacters;
  }
  IndexLease better(indexes, crowd.wanted(kPrice + 1));
  CHECK(better.is_to_make());
  CHECK(better.index().arrangement == Arrangement::kHalved);
  CHECK(&better.index() != made_first);
  {
    const IndexLease meanwhile(indexes, crowd.wanted(kPrice + 1));
    CHECK(!meanwhile.is_to_make());
    CHECK(&meanwhile.index() == made_first);
  }
  better.finish();
  const IndexLease last(indexes, crowd.wanted());
  CHECK(!last.is_to_make());
  CHECK(&last.index() == &better.index());
  batch.input = nullptr;
}

TEST_CASE("indexes: calls about no frame take nothing from those about the last one") {
  Random random(94);
  Crowd crowd(random, 2 * kPrice);
  add_query_index(crowd.indexes(), crowd.engine->sized, crowd.engine->allocator);
  const auto ask_of_no_frame = [&] {
    QueryJob job;
    job.inputs = crowd.inputs;
    job.queries = {crowd.rays.data(), 1};
    std::vector<QueryHit> hits(1);
    job.hits = hits;
    require(run_queries(*crowd.engine, job));
  };
  for (std::size_t i = 0; i <= kPrice; ++i) {
    crowd.ask(i, 1);
    if (i % 10 == 0) ask_of_no_frame();
  }
  CHECK(made(crowd) == 2 + kPrice / 10 + 1);  // two for the frame, and one for each of the others
}

TEST_CASE("indexes: eight threads search the index that one call has made") {
  constexpr std::size_t kThreads = 8, kRays = 200;
  Random random(93);
  Crowd crowd(random, kThreads * kRays);
  std::vector<std::vector<QueryHit>> alone;
  for (std::size_t t = 0; t < kThreads; ++t) alone.push_back(crowd.ask(t * kRays, kRays));
  std::size_t hits = 0;
  for (const auto& of : alone) hits += of.size();
  CHECK(hits > 300);
  for (std::uint64_t round = rounds(40); round > 0; --round) {
    crowd.next_frame();
    const bool is_there = round % 2 == 0;  // else several threads may make one
    if (is_there) crowd.ask(0, 1);
    const std::uint64_t before = made(crowd);
    std::atomic<std::uint32_t> ready{0}, wrong{0};
    std::vector<std::thread> threads;
    for (std::size_t t = 0; t < kThreads; ++t)
      threads.emplace_back([&, t] {
        ++ready;
        while (ready < kThreads) std::this_thread::yield();
        for (std::size_t first = 0; first < kRays; first += 50) {
          const std::vector<QueryHit> got = crowd.ask(t * kRays + first, 50);
          std::size_t matching = 0;  // in the answer alone, whose queries count from another one
          for (QueryHit hit : got) {
            hit.query += static_cast<std::uint32_t>(first);
            matching += std::any_of(alone[t].begin(), alone[t].end(),
                                    [&hit](const QueryHit& of) { return same_hits({of}, {hit}); });
          }
          const auto expected = std::count_if(alone[t].begin(), alone[t].end(), [first](const QueryHit& of) {
            return of.query >= first && of.query < first + 50;
          });
          wrong += matching != got.size() || got.size() != static_cast<std::size_t>(expected);
        }
      });
    for (std::thread& thread : threads) thread.join();
    CHECK(wrong == 0);
    // 1601 rays are more than an index on a curve is made for, so a better one is made once. Who comes meanwhile
    // searches the first.
    CHECK(made(crowd) > before);
    CHECK(made(crowd) <= before + (is_there ? 1 : kThreads + 1));
  }
}

}  // namespace cab::tests
