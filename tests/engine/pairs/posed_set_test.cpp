// The slots of posed characters: one per instance, sixteen per tile, until the set is full.
#include "engine/pairs/posed_set.h"

#include "engine/session/call.h"
#include "engine/session/worker.h"
#include "perf/harness/world.h"

#include <doctest/doctest.h>

#include <set>

namespace cab::tests {
namespace {

using namespace cab::oracle;

constexpr Policies kRows = {Refit::kCab, Strategy::kRows};

// Batches of chains of `links` links, bound for a call, and the first worker's set of posed characters.
struct Slots {
  World world;
  EnginePtr engine;
  std::vector<BatchInput> inputs;
  std::unique_ptr<Call> call;

  Slots(std::uint32_t links, const std::vector<std::uint32_t>& instances) {
    Random random(1);
    for (const std::uint32_t count : instances) {
      Rig rig;
      for (std::uint32_t link = 0; link < links; ++link) {
        rig.parents.push_back(static_cast<std::int32_t>(link) - 1);
        rig.parent_offset.push_back({{0.1, 0, 0}});
        rig.leaves.push_back({link, random_box(random, {}, 0.1, 0.2), {}});
      }
      world.members.push_back({rig, random_poses(random, rig, count, PoseFormat::kMatrix3x4Rows, {})});
    }
    engine = make_engine_for(world);
    for (std::uint32_t m = 0; m < instances.size(); ++m) inputs.push_back(world.members[m].poses.input({m + 1}));
    call = std::make_unique<Call>(*engine);
    for (const BatchInput& input : inputs) call->bind(input);
  }

  PosedSet& set() { return engine->pool[0].pairs.posed; }
  FrameContext frame() { return context_of(*engine, kRows, FrameJob()); }
  std::uint32_t acquire(std::uint32_t batch, std::uint32_t instance) {
    return acquire_slot(frame(), batch, instance, set());
  }
  bool fits(const Candidate& candidate) { return has_room(frame(), candidate, set()); }
};

}  // namespace

TEST_CASE("an instance has one slot, asked for once or again, and no two instances share one") {
  Slots slots(3, {40, 20});
  std::set<std::uint32_t> taken;
  for (std::uint32_t batch = 0; batch < 2; ++batch)
    for (std::uint32_t i = 0; i < slots.inputs.size() * 10; ++i) {
      const std::uint32_t slot = slots.acquire(batch, i);
      CHECK(taken.insert(slot).second);
      CHECK(slots.acquire(batch, i) == slot);
      const PosedTile& tile = slots.set().tile_of(slot);
      CHECK(tile.batch == batch);
      CHECK(tile.instances.instance[slot % kLanes] == i);
    }
}

TEST_CASE("a batch opens a tile for every sixteen of its instances") {
  Slots slots(3, {40, 20});
  for (std::uint32_t i = 0; i < 16; ++i) slots.acquire(0, i);
  CHECK(slots.set().tiles.size == 1);
  slots.acquire(1, 0);
  CHECK(slots.set().tiles.size == 2);
  slots.acquire(0, 16);
  CHECK(slots.set().tiles.size == 3);
  for (std::uint32_t i = 0; i < 17; ++i) slots.acquire(0, i);
  CHECK(slots.set().tiles.size == 3);
}

TEST_CASE("a full set has room for whom it holds and for no other, and for all once it is cleared") {
  const struct {
    std::uint32_t links, tiles;  // with 31 links the set is full of boxes before it is full of tiles
  } cases[] = {{2, kPosedTiles}, {16, kPosedTiles}, {31, kPosedTiles / 2}};
  for (const auto& one : cases) {
    CAPTURE(one.links);
    const std::uint32_t full = one.tiles * kLanes;
    Slots slots(one.links, {kPosedTiles * kLanes + 40});
    for (std::uint32_t i = 0; i < full; ++i) {
      REQUIRE(slots.fits({0, i, 0, i}));
      slots.acquire(0, i);
    }
    CHECK(slots.fits({0, 3, 0, full - 1}));
    CHECK_FALSE(slots.fits({0, full, 0, full}));
    CHECK_FALSE(slots.fits({0, 3, 0, full}));
    clear_set(slots.set());
    CHECK(slots.set().tiles.empty());
    CHECK(slots.set().boxes.empty());
    CHECK(slots.fits({0, 3, 0, full}));
    CHECK(slots.acquire(0, full) == 0);
  }
}

TEST_CASE("two new instances need two lanes of one batch, or a lane of each of two batches") {
  constexpr std::uint32_t kFull = kPosedTiles * kLanes;
  Slots slots(2, {kFull, kFull});
  for (std::uint32_t i = 0; i < kFull - 1 - kLanes; ++i) slots.acquire(0, i);
  slots.acquire(1, 0);  // one lane of batch 0 is free, and fifteen of batch 1
  CHECK(slots.fits({0, kFull - 1, 0, kFull - 1}));
  CHECK_FALSE(slots.fits({0, kFull - 2, 0, kFull - 1}));
  CHECK(slots.fits({0, 0, 0, kFull - 1}));
  CHECK(slots.fits({1, 1, 1, 2}));
  CHECK(slots.fits({0, kFull - 1, 1, 1}));
  slots.acquire(0, kFull - 1);
  CHECK_FALSE(slots.fits({0, kFull - 2, 1, 1}));
  CHECK(slots.fits({0, 0, 1, 1}));
}

TEST_CASE("slots of an earlier set are forgotten when the count of generations wraps around") {
  Slots slots(2, {40});
  PosedSet& set = slots.set();
  slots.acquire(0, 5);  // of generation 1
  set.generation = 0xffffffff;
  clear_set(slots.set());
  CHECK(set.generation == 1);
  slots.acquire(0, 7);
  CHECK(slots.acquire(0, 5) == 1);
}

}  // namespace cab::tests
