// Layers: which instances may be paired, against a judge that compares bit by bit.
#include "perf/harness/random_world.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

namespace {

using namespace cab;
using namespace cab::oracle;
using tests::least_count;
using tests::rounds;

constexpr Strategy kStrategies[] = {Strategy::kTree, Strategy::kRows, Strategy::kLinks, Strategy::kBrute};

// The hits of a frame without layers, except those of instances whose layers and masks do not match.
std::vector<Hit> seen_by_both(const World& world, std::vector<Hit> hits) {
  const auto blind = [&](const Hit& hit) {
    const Member &a = world.members[hit.batch_a.value - 1], &b = world.members[hit.batch_b.value - 1];
    if (&a == &b && hit.instance_a == hit.instance_b) return false;
    return !sees(a, hit.instance_a, b, hit.instance_b) || !sees(b, hit.instance_b, a, hit.instance_a);
  };
  hits.erase(std::remove_if(hits.begin(), hits.end(), blind), hits.end());
  return hits;
}

}  // namespace

TEST_CASE("layers drop the hits of instances whose layers do not match, and no other, for every way to compute them") {
  std::size_t kept = 0, dropped = 0;
  for (std::uint64_t seed = 1; seed <= rounds(12); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    World world;
    add_characters(random, world, 8);
    add_frames(random, world, 8);
    World layered = world;
    add_layers(random, layered);
    for (const Strategy strategy : kStrategies) {
      const Policies policies = {Refit::kCab, strategy, Exact::kNone};
      const std::vector<Hit> all = run_world(world, policies).hits, expected = seen_by_both(layered, all);
      kept += expected.size();
      dropped += all.size() - expected.size();
      for (const Isa isa : available_isas())
        for (const std::uint32_t threads : {1u, 2u}) {
          EngineDesc desc;
          desc.isa = isa;
          desc.thread_count = threads;
          CHECK(same_hits(run_world(layered, policies, desc).hits, expected));
        }
    }
    CHECK(missing_from(judge_world(layered), run_world(layered).hits) == 0);
  }
  CHECK(kept >= least_count(1600, 12));
  CHECK(dropped >= least_count(300, 12));
}

TEST_CASE("instances that layers keep apart cost no candidate and no box test") {
  Random random(1);
  World world;
  add_characters(random, world, 8);
  world.rules = {{{1}, {1}, Pairing::kBetween}};
  REQUIRE(run_world(world).stats.box_tests > 0);
  for (Member& member : world.members) {
    member.layers.assign(member.poses.instance_count, 6);
    member.layer_masks.assign(member.poses.instance_count, 9);
  }
  const FrameStats stats = run_world(world).stats;
  CHECK(stats.candidates == 0);
  CHECK(stats.box_tests == 0);
}
