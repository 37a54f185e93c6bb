// Creating engines, articulations and batches: every status, ids, counts, and one call at a time.
#include "perf/harness/random_world.h"

#include <doctest/doctest.h>

namespace {

using namespace cab;
using namespace cab::oracle;

Rig simple_rig() {
  Random random(1);
  return random_rig(random, Topology::kChain, 3, 1);
}

void* no_memory(void*, std::size_t, std::size_t) { return nullptr; }
void no_release(void*, void*, std::size_t, std::size_t) {}

void run_in_turn(void*, std::uint32_t count, void (*task)(void*, std::uint32_t, std::uint32_t), void* context) {
  for (std::uint32_t t = 0; t < count; ++t) task(context, t, 0);
}

Status create_status(const EngineDesc& desc) {
  auto* const untouched = reinterpret_cast<Engine*>(std::uintptr_t{0x1000});
  Engine* out = untouched;
  const Status status = create_engine(desc, &out);
  if (status == Status::kOk)
    destroy_engine(out);
  else
    CHECK(out == untouched);
  return status;
}

}  // namespace

TEST_CASE("an engine is created on every available instruction set and says which") {
  for (std::uint32_t i = 0; i < kIsaCount; ++i) {
    const auto isa = static_cast<Isa>(i);
    CAPTURE(to_string(isa));
    EngineDesc desc;
    desc.isa = isa;
    CHECK(create_status(desc) == (isa_available(isa) ? Status::kOk : Status::kIsaNotAvailable));
    if (!isa_available(isa)) continue;
    const EnginePtr engine = make_engine(desc);
    if (isa == Isa::kAuto) {
      CHECK(engine_isa(*engine) == available_isas().back());
    } else {
      CHECK(engine_isa(*engine) == isa);
    }
  }
  EngineDesc desc;
  desc.isa = static_cast<Isa>(77);
  CHECK(create_status(desc) == Status::kIsaNotAvailable);
}

TEST_CASE("half an allocator, half a scheduler and a scheduler of too many workers are refused") {
  for (const Allocator& half :
       {Allocator{nullptr, no_memory, nullptr}, Allocator{nullptr, nullptr, no_release}, Allocator{}}) {
    EngineDesc desc;
    desc.allocator = &half;
    CHECK(create_status(desc) == Status::kBadAllocator);
  }
  for (const Scheduler& half : {Scheduler{nullptr, 0, run_in_turn}, Scheduler{nullptr, 2, nullptr}, Scheduler{}}) {
    EngineDesc desc;
    desc.scheduler = &half;
    CHECK(create_status(desc) == Status::kBadScheduler);
  }
  for (const std::uint32_t workers : {kMaxWorkers, kMaxWorkers + 1, 0xffffffffu}) {
    const Scheduler scheduler = {nullptr, workers, run_in_turn};
    EngineDesc desc;
    desc.scheduler = &scheduler;
    CAPTURE(workers);
    CHECK(create_status(desc) == (workers == kMaxWorkers ? Status::kOk : Status::kBadScheduler));
  }
}

TEST_CASE("ids count up from 1, and info tells what was added") {
  const EnginePtr engine = make_engine();
  Random random(5);
  for (std::uint32_t id = 1; id <= 5; ++id) {
    const Rig rig = any_rig(random, 32);
    CHECK(static_cast<std::uint32_t>(add_rig(*engine, rig).value) == id);
    CHECK(slot_of(add_instances(*engine, {id}, 7)).value == id);
    ArticulationInfo info;
    REQUIRE(articulation_info(*engine, {id}, &info) == Status::kOk);
    CHECK(info.link_count == rig.link_count());
    CHECK(info.leaf_count == rig.leaf_count());
    CHECK(info.node_count == rig.node_count());
    CHECK(info.depth < info.leaf_count);
    CHECK((1u << info.depth) >= info.leaf_count);
  }
}

TEST_CASE("a batch tells what it was added as, until it is removed") {
  const EnginePtr engine = make_engine();
  Random random(6);
  const ArticulationId first = add_rig(*engine, any_rig(random, 8)), second = add_rig(*engine, any_rig(random, 8));
  const BatchId characters = add_instances(*engine, second, 7);
  const BatchId sequence = add_instances(*engine, first, 3, BatchKind::kSequence);
  StaticBody wall;
  wall.box = random_box(random, {}, 1, 2);
  BatchId walls;
  REQUIRE(add_static_batch(*engine, {{&wall, 1}, {}, {}, {}}, &walls) == Status::kOk);
  BatchInfo info;
  REQUIRE(batch_info(*engine, characters, &info) == Status::kOk);
  CHECK(info.articulation.value == second.value);
  CHECK(info.instance_count == 7);
  CHECK(info.kind == BatchKind::kCharacters);
  CHECK_FALSE(info.is_static);
  REQUIRE(batch_info(*engine, sequence, &info) == Status::kOk);
  CHECK(info.articulation.value == first.value);
  CHECK(info.kind == BatchKind::kSequence);
  REQUIRE(batch_info(*engine, walls, &info) == Status::kOk);
  CHECK(info.articulation.value == 0);
  CHECK(info.instance_count == 1);
  CHECK(info.is_static);
  CHECK(batch_info(*engine, walls, nullptr) == Status::kBadOutput);
  REQUIRE(remove_batch(*engine, sequence) == Status::kOk);
  CHECK(batch_info(*engine, sequence, &info) == Status::kUnknownBatch);
  CHECK(batch_info(*engine, {}, &info) == Status::kUnknownBatch);
  CHECK(info.is_static);
}

TEST_CASE("unknown articulations are refused, with outputs untouched") {
  const EnginePtr engine = make_engine();
  add_rig(*engine, simple_rig());
  for (const std::uint32_t id : {0u, 2u, 0xffffffffu}) {
    CAPTURE(id);
    ArticulationInfo info = {7, 7, 7, 7};
    CHECK(articulation_info(*engine, {id}, &info) == Status::kUnknownArticulation);
    CHECK(info.node_count == 7);
    MergeStep step = {1, 2, 3};
    CHECK(merge_steps(*engine, {id}, {&step, 1}) == Status::kUnknownArticulation);
    CHECK(step.joint_link == 3);
    BatchId batch = {42};
    CHECK(add_batch(*engine, {{id}, 1, BatchKind::kCharacters}, &batch) == Status::kUnknownArticulation);
    CHECK(batch.value == 42);
  }
}

TEST_CASE("merge_steps needs room for all steps, and none for a single leaf") {
  const EnginePtr engine = make_engine();
  const Rig rig = simple_rig();
  add_rig(*engine, rig);
  std::vector<MergeStep> steps(rig.leaf_count() - 1);
  CHECK(merge_steps(*engine, {1}, {steps.data(), steps.size() - 1}) == Status::kBadOutput);
  CHECK(merge_steps(*engine, {1}, {nullptr, steps.size()}) == Status::kBadOutput);
  CHECK(merge_steps(*engine, {1}, steps) == Status::kOk);
  Rig one = simple_rig();
  one.leaves.resize(1);
  add_rig(*engine, one);
  CHECK(merge_steps(*engine, {2}, {}) == Status::kOk);
}

TEST_CASE("a batch needs 1 to kMaxInstances instances, and an engine holds kMaxBatches batches") {
  const EnginePtr engine = make_engine();
  Rig one = simple_rig();
  one.leaves.resize(1);
  add_rig(*engine, one);
  BatchId batch = {42};
  CHECK(add_batch(*engine, {{1}, 0, BatchKind::kCharacters}, &batch) == Status::kNoInstances);
  CHECK(add_batch(*engine, {{1}, kMaxInstances + 1, BatchKind::kSequence}, &batch) == Status::kTooManyInstances);
  CHECK(add_batch(*engine, {{1}, 0xffffffffu, BatchKind::kCharacters}, &batch) == Status::kTooManyInstances);
  CHECK(batch.value == 42);
  REQUIRE(reserve(*engine, {kMaxBatches, kMaxBatches}) == Status::kOk);  // else each batch makes new memory
  for (std::uint32_t i = 0; i < kMaxBatches; ++i)
    REQUIRE(add_batch(*engine, {{1}, 1, BatchKind::kCharacters}, &batch) == Status::kOk);
  CHECK(slot_of(batch).value == kMaxBatches);
  CHECK(add_batch(*engine, {{1}, 1, BatchKind::kCharacters}, &batch) == Status::kTooManyInstances);
}

TEST_CASE("a bad articulation is refused with the element at fault, and takes no id") {
  const EnginePtr engine = make_engine();
  Rig rig = simple_rig();
  rig.leaves.back().box.half[1] = -1;
  ArticulationId id = {42};
  std::uint32_t element = 42;
  CHECK(add_articulation(*engine, rig.desc(), &id, &element) == Status::kBadLeafBox);
  CHECK(id.value == 42);
  CHECK(element == rig.leaf_count() - 1);
  CHECK(add_articulation(*engine, rig.desc(), &id) == Status::kBadLeafBox);
  CHECK(static_cast<std::uint32_t>(add_rig(*engine, simple_rig()).value) == 1);
}

TEST_CASE("a call inside another call on the same engine is refused as busy, and the outer call goes on") {
  struct Reentry {
    Engine* engine = nullptr;
    World* world = nullptr;
    int refused = 0, other = 0;
  } reentry;
  const Scheduler scheduler = {
      &reentry, 1,
      [](void* user, std::uint32_t count, void (*task)(void*, std::uint32_t, std::uint32_t), void* context) {
        auto& at = *static_cast<Reentry*>(user);
        const auto tally = [&](Status status) { ++(status == Status::kBusy ? at.refused : at.other); };
        FrameJob job;
        tally(run_frame(*at.engine, job));
        ArticulationId articulation;
        tally(add_articulation(*at.engine, at.world->members[0].rig.desc(), &articulation));
        BatchId batch;
        tally(add_batch(*at.engine, {{1}, 1, BatchKind::kCharacters}, &batch));
        Box box;
        tally(compute_boxes(*at.engine, at.world->members[0].poses.input({1}), {}, {&box, 1}));
        std::uint32_t order;
        tally(spatial_order(*at.engine, {1}, {&order, 1}));
        for (std::uint32_t t = 0; t < count; ++t) task(context, t, 0);
      }};
  Random random(2);
  World world;
  add_characters(random, world, 6);
  EngineDesc desc;
  desc.scheduler = &scheduler;
  const EnginePtr engine = make_engine_for(world, desc);
  reentry.engine = engine.get();
  reentry.world = &world;
  // With strategy rows the scheduler would not get so small a frame.
  const Outcome outcome = run_on(*engine, world, {Refit::kCab, Strategy::kTree});
  CHECK(reentry.refused > 0);
  CHECK(reentry.other == 0);
  CHECK(same_hits(outcome.hits, run_world(world).hits));
}

TEST_CASE("thousands of links: the largest chain and the largest star run, whole") {
  for (const Topology topology : {Topology::kChain, Topology::kStar}) {
    Random random(3);
    World world;
    Member member;
    member.rig = random_rig(random, topology, kMaxLinks, 1);
    if (topology == Topology::kChain)
      for (auto& offset : member.rig.parent_offset) offset = 0.2 * offset;
    member.poses = random_poses(random, member.rig, 2, PoseFormat::kMatrix3x4Rows, {0.1, false, false, {}});
    world.members = {member, member};
    world.members[1].kind = BatchKind::kSequence;
    world.rules = {{{1}, {1}, Pairing::kBetween}, {{1}, {1}, Pairing::kWithin}, {{2}, {2}, Pairing::kWithin}};
    const Outcome tree = run_world(world, {Refit::kCab, Strategy::kTree}),
                  brute = run_world(world, {Refit::kCab, Strategy::kBrute, Exact::kNone});
    CHECK(tree.hits.size() > 1000);
    CHECK(same_hits(tree.hits, brute.hits));
    CHECK(missing_from(judge_world(world), tree.hits) == 0);
  }
}
