// The strategies rows and auto: they find the hits of brute in every world, with every refit.
#include "perf/harness/random_world.h"
#include "tests/engine/thread_pool.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

namespace {

using namespace cab;
using namespace cab::oracle;
using namespace cab::tests;

World random_crowd(Random& random, unsigned most_links, double spread, bool far) {
  World world;
  for (int m = 0; m < 2; ++m)
    world.members.push_back(any_member(random, kInstanceCounts[random.index(6)], BatchKind::kCharacters,
                                       any_pose_range(random, far, {{1e6, -1e8, 1e3}}, spread), most_links));
  pair_all(world, 1, 2);
  return world;
}

}  // namespace

TEST_CASE("rows report what brute reports, with fewer box tests, on every instruction set") {
  std::size_t hits = 0;
  for (std::uint64_t seed = 1; seed <= rounds(30); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    const World world = random_crowd(random, 24, 1.5, seed % 2);
    for (const Refit refit : {Refit::kCab, Refit::kAabbHull, Refit::kAabbVertices}) {
      const Outcome brute = run_world(world, {refit, Strategy::kBrute, Exact::kNone});
      FrameStats first;
      for (const Isa isa : available_isas()) {
        EngineDesc desc;
        desc.isa = isa;
        const Outcome rows = run_world(world, {refit, Strategy::kRows, Exact::kNone}, desc);
        CHECK(same_hits(rows.hits, brute.hits));
        CHECK(rows.stats.leaf_pairs == brute.stats.leaf_pairs);
        CHECK(rows.stats.box_tests <= brute.stats.box_tests);
        if (isa == Isa::kScalar) first = rows.stats;
        CHECK(same_counts(rows.stats, first));
      }
      hits += brute.hits.size();
    }
  }
  CHECK(hits >= least_count(3000, 30));
}

TEST_CASE("rows lose no pair of boxes that touch face on face, near and far from the world's origin") {
  Rig rig;
  rig.parents = {-1};
  for (int i = 0; i < 17; ++i)  // one leaf more than there are lanes
    rig.leaves.push_back(
        {0, {{0.25f * static_cast<float>(i), 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0.125f, 0.125f, 0.125f}}, {}});
  for (const double out : {0.0, 1e4, 1e7, 3e9}) {
    CAPTURE(out);
    World world;
    for (int m = 0; m < 2; ++m) {
      Poses poses;
      poses.link_count = poses.instance_count = 1;
      poses.data = {0, 0, 0, 1, 0, 0, 0};
      poses.origins = {out, -out, m ? 0.25 : 0.0};
      world.members.push_back({rig, poses, BatchKind::kCharacters});
    }
    world.rules = {{{1}, {2}, Pairing::kBetween}};
    CHECK(run_world(world, {Refit::kCab, Strategy::kRows}).stats.leaf_pairs == 17 + 2 * 16);
  }
}

TEST_CASE("auto is rows, links from 49 leaves on where links have several, tree beyond 128 links of a chain") {
  struct Choice {
    std::uint32_t links, leaves;  // links with leaves, and leaves of all
    Strategy strategy;
    bool chain = false;
  };
  for (const Choice& choice :
       {Choice{1, 48, Strategy::kRows}, Choice{32, 48, Strategy::kRows}, Choice{1, 49, Strategy::kLinks},
        Choice{48, 49, Strategy::kLinks}, Choice{64, 64, Strategy::kRows}, Choice{64, 65, Strategy::kLinks},
        Choice{65, 65, Strategy::kRows}, Choice{65, 130, Strategy::kLinks}, Choice{128, 128, Strategy::kRows, true},
        Choice{129, 129, Strategy::kTree, true}, Choice{129, 258, Strategy::kTree, true}}) {
    CAPTURE(choice.chain);
    CAPTURE(choice.links);
    CAPTURE(choice.leaves);
    Random random(choice.leaves);
    Rig rig;
    for (std::uint32_t link = 0; link < choice.links + 3; ++link) {  // three have no leaf
      const auto at = static_cast<std::int32_t>(link);
      rig.parents.push_back(choice.chain || at < 2 ? at - 1 : at - 2);  // else two branches
      rig.parent_offset.push_back(0.05 * random.unit_vector());
    }
    for (std::uint32_t i = 0; i < choice.leaves; ++i)
      rig.leaves.push_back({i % choice.links, random_box(random, 0.5 * random.unit_vector(), 0.03, 0.1), {}});
    World world;
    world.members = {{rig, random_poses(random, rig, 20, PoseFormat::kMatrix3x4Rows, {1.0, false, true, {}}),
                      BatchKind::kCharacters}};
    pair_all(world, 1, 1);
    const Outcome chosen = run_world(world, {Refit::kCab, Strategy::kAuto});
    CHECK(chosen.hits.size() > 0);
    for (const Strategy strategy : {Strategy::kRows, Strategy::kLinks, Strategy::kTree}) {
      const Outcome outcome = run_world(world, {Refit::kCab, strategy});
      CHECK(same_hits(chosen.hits, outcome.hits));
      if (strategy == Strategy::kLinks && choice.links == choice.leaves) continue;  // that may be rows
      CHECK((chosen.stats.box_tests == outcome.stats.box_tests) == (strategy == choice.strategy));
    }
  }
}

namespace {

// Characters of one kind in a small room, with the same draws of places for every kind.
Member in_a_room(const Rig& rig, std::uint64_t seed, PoseFormat format) {
  Random random(seed);
  return {rig, random_poses(random, rig, 9, format, {1.0, false, true, {}}), BatchKind::kCharacters};
}

// A rope of 200 links, a body of 40 links with up to three leaves each, and one of 16 links that branches: auto pairs
// each of them by another strategy.
World rope_and_detailed_and_plain(PoseFormat format = PoseFormat::kQuaternionTranslation) {
  Random random(9);
  World world;
  Rig rope = random_rig(random, Topology::kChain, 200, 1), detailed = random_rig(random, Topology::kTree, 40, 3),
      plain = random_rig(random, Topology::kTree, 16, 1);
  world.members = {in_a_room(rope, 1, format), in_a_room(detailed, 2, format), in_a_room(plain, 3, format)};
  return world;
}

}  // namespace

TEST_CASE("auto pairs every two articulations by the strategy for these two, whatever else is in the frame") {
  // With matrices none has words, which let a few more boxes through.
  World world = rope_and_detailed_and_plain(PoseFormat::kMatrix3x4Rows);
  constexpr Strategy kNoneOfThem = Strategy::kAuto;
  const struct {
    std::uint32_t a, b;
    Strategy strategy;  // that makes the same box tests
  } rows[] = {{1, 1, Strategy::kTree},  {1, 2, kNoneOfThem},      {1, 3, Strategy::kRows},
              {2, 2, Strategy::kLinks}, {2, 3, Strategy::kLinks}, {3, 3, Strategy::kRows}};
  std::uint64_t of_pairs = 0;
  for (const auto& row : rows) {
    CAPTURE(row.a);
    CAPTURE(row.b);
    world.rules = {{{row.a}, {row.b}, Pairing::kBetween}};
    if (row.a == row.b) world.rules.push_back({{row.a}, {row.a}, Pairing::kWithin});
    const Outcome chosen = run_world(world, {Refit::kCab, Strategy::kAuto});
    CHECK(chosen.hits.size() > 0);
    CHECK(same_hits(chosen.hits, run_world(world, {Refit::kCab, Strategy::kBrute}).hits));
    if (row.strategy != kNoneOfThem)
      CHECK(chosen.stats.box_tests == run_world(world, {Refit::kCab, row.strategy}).stats.box_tests);
    of_pairs += chosen.stats.box_tests;
  }
  world.rules.clear();
  pair_all(world, 1, 3);
  CHECK(run_world(world, {Refit::kCab, Strategy::kAuto}).stats.box_tests == of_pairs);
}

TEST_CASE("a frame of ropes, detailed and plain bodies reports what brute reports, by every refit, test and ISA") {
  World world = rope_and_detailed_and_plain();
  pair_all(world, 1, 3);
  for (const float margin : {0.0f, 0.05f})
    for (const Refit refit : {Refit::kCab, Refit::kBest3, Refit::kAabbHull})
      for (const Exact exact : {Exact::kNone, Exact::kConvex}) {
        CAPTURE(margin);
        CAPTURE(static_cast<int>(refit));
        CAPTURE(static_cast<int>(exact));
        world.margin = margin;
        const Outcome brute = run_world(world, {refit, Strategy::kBrute, exact});
        CHECK(brute.hits.size() > 0);
        for (const Isa isa : available_isas()) {
          CAPTURE(to_string(isa));
          EngineDesc desc;
          desc.isa = isa;
          const EnginePtr engine = make_engine_for(world, desc);
          CHECK(same_hits(run_on(*engine, world, {refit, Strategy::kAuto, exact}).hits, brute.hits));
          CHECK(run_on(*engine, world, {refit, Strategy::kAuto, exact}, run_frame, Report::kInContact).in_contact ==
                brute.in_contact);
        }
      }
}

TEST_CASE("hits are in order for any number of workers, also where a worker keeps fewer hits than a task has") {
  Random random(5);
  World world = random_crowd(random, 12, 0.4, false);  // crowded: more hits per task than a worker keeps
  for (Member& member : world.members)
    member = any_member(random, 300, BatchKind::kCharacters, {0.6, false, true, {}}, 12);
  const Outcome serial = run_world(world, {Refit::kCab, Strategy::kRows});
  CHECK(serial.hits.size() > 100'000);
  CHECK(std::is_sorted(serial.hits.begin(), serial.hits.end(), link_less));
  for (const std::uint32_t workers : {2u, 3u, 8u}) {
    CAPTURE(workers);
    ThreadPool pool(workers);
    const Scheduler scheduler = pool.scheduler();
    EngineDesc desc;
    desc.scheduler = &scheduler;
    CHECK(same_hits(run_world(world, {Refit::kCab, Strategy::kRows}, desc).hits, serial.hits));
    CHECK(pool.tasks_run() > 0);
  }
}
