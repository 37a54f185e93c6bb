// The strategies rows and auto: they find the hits of brute in every world, with every refit.
#include "perf/oracle/random_world.h"
#include "tests/engine/thread_pool.h"

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
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
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
  CHECK(hits > 3000);
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

TEST_CASE(
    "auto is rows, links from 49 leaves on where links have several, tree beyond 64 links with leaves or 47 of a "
    "chain") {
  struct Choice {
    std::uint32_t links, leaves;  // links with leaves, and leaves of all
    Strategy strategy;
    bool chain = false;
  };
  for (const Choice& choice :
       {Choice{1, 48, Strategy::kRows}, Choice{32, 48, Strategy::kRows}, Choice{1, 49, Strategy::kLinks},
        Choice{48, 49, Strategy::kLinks}, Choice{64, 64, Strategy::kRows}, Choice{64, 65, Strategy::kLinks},
        Choice{65, 65, Strategy::kTree}, Choice{65, 130, Strategy::kTree}, Choice{47, 47, Strategy::kRows, true},
        Choice{48, 48, Strategy::kTree, true}, Choice{48, 96, Strategy::kTree, true}}) {
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
    for (const bool small : {false, true}) {  // the larger articulation decides
      if (small) rig = random_rig(random, Topology::kTree, 4, 3);
      world.members.push_back(
          {rig, random_poses(random, rig, 20, PoseFormat::kMatrix3x4, {1.0, false, true, {}}), BatchKind::kCharacters});
    }
    pair_all(world, 1, 2);
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
