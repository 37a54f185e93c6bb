// Batches and articulations that come and go: ids, slots, memory, and frames in between.
#include "engine/session/engine.h"
#include "perf/harness/random_world.h"
#include "perf/harness/world.h"
#include "tests/engine/counted_memory.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <map>

namespace cab::tests {
namespace {

using namespace cab::oracle;

// A batch that lives in an engine, and its articulation.
struct Living {
  ArticulationId articulation;
  BatchId batch;
  Member member;
};

Member any_body(Random& random) {
  Member out;
  out.rig = random_rig(random, static_cast<Topology>(random.index(3)), 2 + random.index(12), 1 + random.index(3));
  out.poses = random_poses(random, out.rig, 1 + random.index(40), PoseFormat::kQuaternionTranslation,
                           {1.5, random.chance(0.5), random.chance(0.5), {}});
  return out;
}

Living add(Engine& engine, const Member& member) {
  const ArticulationId articulation = add_rig(engine, member.rig);
  return {articulation, add_instances(engine, articulation, member.poses.instance_count), member};
}

// The hits of a frame of all living batches, each with each and within itself. Batches are named by their place in the
// order of slots.
std::vector<Hit> hits_of(Engine& engine, const std::map<std::uint32_t, Living>& living, const Policies& policies) {
  std::vector<BatchInput> inputs;
  std::vector<PairRule> rules;
  std::map<std::uint32_t, std::uint32_t> place;
  for (const auto& a : living) {
    inputs.push_back(a.second.member.poses.input(a.second.batch));
    place[a.first] = static_cast<std::uint32_t>(inputs.size());
    rules.push_back({a.second.batch, a.second.batch, Pairing::kWithin});
    for (const auto& b : living)
      if (a.first <= b.first) rules.push_back({a.second.batch, b.second.batch, Pairing::kBetween});
  }
  std::vector<Hit> hits(200000);
  FrameJob job;
  job.inputs = inputs;
  job.rules = rules;
  job.policies = policies;
  job.hits = hits;
  REQUIRE(run_frame(engine, job) == Status::kOk);
  hits.resize(job.hit_count);
  for (Hit& hit : hits) {
    hit.batch_a = {place.at(hit.batch_a.value)};
    hit.batch_b = {place.at(hit.batch_b.value)};
  }
  return hits;
}

std::vector<Hit> fresh_hits(const std::map<std::uint32_t, Living>& living, const Policies& policies) {
  const EnginePtr engine = make_engine();
  std::map<std::uint32_t, Living> anew;
  for (const auto& one : living)
    anew.emplace(static_cast<std::uint32_t>(anew.size()) + 1, add(*engine, one.second.member));
  return hits_of(*engine, anew, policies);
}

}  // namespace

TEST_CASE("batches that come and go have the hits of a fresh engine, and memory does not grow with their number") {
  Random random(1);
  CountedMemory counted;
  const Allocator allocator = counted.allocator();
  EngineDesc desc;
  desc.allocator = &allocator;
  std::size_t hits = 0, most = 0;
  {
    const EnginePtr engine = make_engine(desc);
    std::map<std::uint32_t, Living> living;
    for (std::uint64_t step = 0; step < rounds(400); ++step) {
      CAPTURE(step);
      if (living.size() < 3 || (living.size() < 8 && random.chance(0.5))) {
        const Living one = add(*engine, any_body(random));
        CHECK(living.emplace(slot_of(one.batch).value, one).second);
      } else {
        auto gone = living.begin();
        std::advance(gone, random.index(static_cast<unsigned>(living.size())));
        CHECK(remove_articulation(*engine, gone->second.articulation) == Status::kArticulationInUse);
        CHECK(remove_batch(*engine, gone->second.batch) == Status::kOk);
        CHECK(remove_batch(*engine, gone->second.batch) == Status::kUnknownBatch);
        CHECK(remove_articulation(*engine, gone->second.articulation) == Status::kOk);
        CHECK(remove_articulation(*engine, gone->second.articulation) == Status::kUnknownArticulation);
        living.erase(gone);
      }
      CHECK(living.rbegin()->first <= 8);  // slots are taken again
      EngineMemory memory;
      REQUIRE(engine_memory(*engine, &memory) == Status::kOk);
      CHECK(memory.total == counted.bytes);
      CHECK(memory.articulations + memory.batches + memory.workers + memory.broad_phase + memory.hits <= memory.total);
      if (step == rounds(400) / 2) most = memory.total;
      const Policies policies = {Refit::kCab, step % 2 ? Strategy::kAuto : Strategy::kTree};
      const std::size_t calls = counted.calls;
      const std::vector<Hit> found = hits_of(*engine, living, policies);
      CHECK(counted.calls == calls);
      CHECK(same_hits(found, fresh_hits(living, policies)));
      hits += found.size();
    }
    EngineMemory memory;
    REQUIRE(engine_memory(*engine, &memory) == Status::kOk);
    CHECK(memory.total < 2 * most);
  }
  CHECK(counted.bytes == 0);
  CHECK(hits >= least_count(20000, 400));
}

TEST_CASE("an id that is stale, of another engine, or of nothing is refused by every call, and a bare slot is not") {
  Random random(2);
  const Member member = any_body(random);
  const EnginePtr engine = make_engine(), other = make_engine();
  const Living first = add(*engine, member), foreign = add(*other, member);
  CHECK(slot_of(first.batch).value == 1);
  CHECK(slot_of(foreign.batch).value == 1);
  CHECK(first.batch.value != foreign.batch.value);
  REQUIRE(remove_batch(*engine, first.batch) == Status::kOk);
  REQUIRE(remove_articulation(*engine, first.articulation) == Status::kOk);
  const Living second = add(*engine, member);
  CHECK(slot_of(second.batch).value == 1);
  CHECK(second.batch.value != first.batch.value);

  std::vector<Box> boxes(std::size_t{member.poses.instance_count} * member.rig.node_count());
  std::vector<std::uint32_t> order(member.poses.instance_count);
  const auto statuses = [&](BatchId id) {
    const BatchInput input = member.poses.input(id);
    FrameJob job;
    job.inputs = {&input, 1};
    MaskReason reason;
    return std::vector<Status>{compute_boxes(*engine, input, {}, boxes), run_frame(*engine, job),
                               why_masked(*engine, input, 0, &reason), compute_contacts(*engine, {&input, 1}, {}, {}),
                               spatial_order(*engine, id, order)};
  };
  const std::vector<Status> ok(5, Status::kOk), unknown(5, Status::kUnknownBatch);
  CHECK(statuses(second.batch) == ok);
  CHECK(statuses({1}) == ok);
  CHECK(statuses(first.batch) == unknown);
  CHECK(statuses(foreign.batch) == unknown);
  for (const std::uint64_t none : {0u, 2u, 0xffffffffu}) CHECK(statuses({none}) == unknown);
  for (const BatchId id : {first.batch, foreign.batch, BatchId{2}}) {
    const BatchInput input = member.poses.input(second.batch);
    const PairRule rule = {second.batch, id};
    FrameJob job;
    job.inputs = {&input, 1};
    job.rules = {&rule, 1};
    CHECK(run_frame(*engine, job) == Status::kBadPairRule);
    CHECK(remove_batch(*engine, id) == Status::kUnknownBatch);
  }

  ArticulationInfo info;
  BatchId out;
  for (const ArticulationId id : {first.articulation, foreign.articulation, ArticulationId{0}, ArticulationId{2}}) {
    CHECK(articulation_info(*engine, id, &info) == Status::kUnknownArticulation);
    CHECK(add_batch(*engine, {id, 5, BatchKind::kCharacters}, &out) == Status::kUnknownArticulation);
    CHECK(remove_articulation(*engine, id) == Status::kUnknownArticulation);
  }
  CHECK(articulation_info(*engine, {1}, &info) == Status::kOk);
  CHECK(articulation_info(*engine, second.articulation, &info) == Status::kOk);
  CHECK(engine_memory(*engine, nullptr) == Status::kBadOutput);
}

TEST_CASE("ids of removed batches stay refused, however many batches are added in their place") {
  Random random(7);
  const Member member = any_body(random);
  const EnginePtr engine = make_engine();
  const Living first = add(*engine, member);
  HistoryId history;
  REQUIRE(add_history(*engine, {first.batch, 2}, &history) == Status::kOk);
  REQUIRE(remove_batch(*engine, first.batch) == Status::kOk);
  BatchId id;
  for (std::uint32_t added = 0; added < 70'000; ++added) {  // more than 2^16
    REQUIRE(add_batch(*engine, {first.articulation, 1, BatchKind::kCharacters}, &id) == Status::kOk);
    REQUIRE(id.value != first.batch.value);
    BatchInfo info;
    REQUIRE(batch_info(*engine, first.batch, &info) == Status::kUnknownBatch);
    REQUIRE(remove_batch(*engine, id) == Status::kOk);
  }
  REQUIRE(add_batch(*engine, {first.articulation, 1, BatchKind::kCharacters}, &id) == Status::kOk);
  CHECK(slot_of(id) == slot_of(first.batch));
  CHECK(record_tick(*engine, history, member.poses.input(id), 1) == Status::kUnknownBatch);
}

TEST_CASE("after reserve, adding batches within it makes no new memory of workers") {
  Random random(3);
  CountedMemory counted;
  const Allocator allocator = counted.allocator();
  EngineDesc desc;
  desc.allocator = &allocator;
  const EnginePtr engine = make_engine(desc);
  std::vector<ArticulationId> articulations;
  for (int a = 0; a < 3; ++a) articulations.push_back(add_rig(*engine, any_body(random).rig));
  REQUIRE(reserve(*engine, {6, 900}) == Status::kOk);
  EngineMemory before, after;
  REQUIRE(engine_memory(*engine, &before) == Status::kOk);
  CHECK(before.workers > 0);
  CHECK(before.batches == 0);
  for (std::uint32_t b = 0; b < 6; ++b) add_instances(*engine, articulations[b % 3], 150);
  REQUIRE(engine_memory(*engine, &after) == Status::kOk);
  CHECK(after.workers == before.workers);
  CHECK(after.broad_phase == before.broad_phase);
  CHECK(after.hits == before.hits);
  CHECK(after.batches > 0);
  REQUIRE(reserve(*engine, {2, 10}) == Status::kOk);  // less than there is: nothing changes
  CHECK(engine_memory(*engine, &before) == Status::kOk);
  CHECK(before.total == after.total);
  add_instances(*engine, articulations[0], 100);
  REQUIRE(engine_memory(*engine, &after) == Status::kOk);
  CHECK(after.broad_phase > before.broad_phase);
  CHECK(reserve(*engine, {4097, 10}) == Status::kTooManyInstances);
  CHECK(reserve(*engine, {1, 0xffffffff}) == Status::kTooManyInstances);
}

}  // namespace cab::tests
