// How often characters are posed for tests: the candidates of large articulations wait for each other.
#include "engine/pairs/pair_scratch.h"
#include "engine/session/engine.h"
#include "perf/harness/random_world.h"
#include "perf/harness/world.h"
#include "tests/engine/thread_pool.h"

#include <doctest/doctest.h>

namespace cab::tests {
namespace {

using namespace cab::oracle;

// Rods of `links` short boxes in a row, in random directions about the origin: the bounds of most meet, few touch.
Member rods(Random& random, std::uint32_t links, std::uint32_t count) {
  Member out;
  for (std::uint32_t link = 0; link < links; ++link) {
    out.rig.parents.push_back(static_cast<std::int32_t>(link) - 1);
    out.rig.parent_offset.push_back({{0.1, 0, 0}});
    out.rig.leaves.push_back({link, {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0.05f, 0.02f, 0.02f}}, {}});
  }
  // Matrices, which have no words.
  out.poses = random_poses(random, out.rig, count, PoseFormat::kMatrix3x4Rows, {1, true, true, {}});
  for (std::uint32_t i = 0; i < count; ++i)
    for (std::uint32_t link = 0; link < links; ++link) {
      const float along = 0.1f * (static_cast<float>(link) - 0.5f * static_cast<float>(links));
      const float pose[] = {1, 0, 0, along, 0, 1, 0, 0, 0, 0, 1, 0};
      std::copy_n(pose, 12, out.poses.pose(i, link));
    }
  return out;
}

}  // namespace

TEST_CASE("a large body that meets many others is posed a few times, not once for each sixteen of them") {
  Random random(1);
  World world;
  for (const std::uint32_t links : {120u, 100u, 3u}) world.members.push_back(rods(random, links, 48));
  for (std::uint32_t a = 1; a <= 3; ++a)
    for (std::uint32_t b = a; b <= 3; ++b) world.rules.push_back({{a}, {b}, Pairing::kBetween});
  world.rules.push_back({{1}, {1}, Pairing::kWithin});
  const Outcome brute = run_world(world, {Refit::kCab, Strategy::kBrute});
  REQUIRE(brute.stats.candidates > std::size_t{96} * 95 / 2 * 3 / 4);  // most of the large ones meet
  REQUIRE(brute.hits.size() > 100);
  ThreadPool pool(3);
  const Scheduler scheduler = pool.scheduler();
  for (const Strategy strategy : {Strategy::kTree, Strategy::kRows, Strategy::kAuto})
    for (const bool threads : {false, true}) {
      CAPTURE(static_cast<int>(strategy));
      EngineDesc desc;
      if (threads) desc.scheduler = &scheduler;
      const EnginePtr engine = make_engine_for(world, desc);
      const Outcome found = run_on(*engine, world, {Refit::kCab, strategy});
      CHECK(same_hits(found.hits, brute.hits));
      CHECK(found.stats.candidates == brute.stats.candidates);
      // Sixteen of one kind with sixteen of another are 32 poses for 256 candidates. With threads it depends on who
      // takes which task.
      MESSAGE(found.stats.instances_posed << " poses for " << found.stats.candidates << " candidates");
      if (!threads) CHECK(found.stats.instances_posed * 4 < found.stats.candidates);
    }
}

TEST_CASE("who came to rest late meets who has rested longer, also where hits are not kept") {
  // Pairs of cubes that touch. From the second frame on all rest but the first cubes of some pairs, which come to rest
  // in the third: too few for the grid of those that rest to be built anew.
  constexpr std::uint32_t kCount = 400;
  World world;
  Member member;
  member.rig.parents = {-1};
  member.rig.leaves = {{0, {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0.5f, 0.5f, 0.5f}}, {}}};
  member.poses.link_count = 1;
  member.poses.instance_count = kCount;
  for (std::uint32_t i = 0; i < kCount; ++i) {
    member.poses.data.insert(member.poses.data.end(), {0, 0, 0, 1, 0, 0, 0});
    member.poses.origins.insert(member.poses.origins.end(), {10.0 * (i / 2) + 0.75 * (i % 2), 0, 0});
  }
  std::vector<std::uint8_t> moved(kCount, 1), in_contact(kCount);
  std::vector<Hit> hits(kCount);
  BatchInput input = member.poses.input({1});
  input.moved = moved;
  input.in_contact = in_contact;
  const PairRule rule = {{1}, {1}, Pairing::kBetween};
  world.members = {member};
  for (const Report report : {Report::kHits, Report::kInContact}) {
    const EnginePtr engine = make_engine_for(world);
    FrameJob job;
    job.inputs = {&input, 1};
    job.rules = {&rule, 1};
    job.report = report;
    job.hits = hits;
    for (int frame = 0; frame < 4; ++frame) {
      CAPTURE(frame);
      for (std::uint32_t i = 0; i < kCount; ++i) moved[i] = frame == 0 || (frame == 1 && i % 20 == 0);
      engine->hit_store.holds_last = false;  // as after a frame that answered kHitsOverflow
      REQUIRE(run_frame(*engine, job) == Status::kOk);
      CHECK(job.stats.instances_resting == (frame == 0 ? 0 : frame == 1 ? kCount - kCount / 20 : kCount));
      CHECK(in_contact == std::vector<std::uint8_t>(kCount, 1));
      if (report == Report::kHits) CHECK(job.hit_count == kCount / 2);
      if (frame > 0) CHECK(engine->crowd.kept.end_sorted == kCount - kCount / 20);
    }
  }
}

TEST_CASE("more waiting candidates than there is room for are tested in between") {
  Random random(2);
  World world;
  world.members = {rods(random, 100, 200)};
  world.rules = {{{1}, {1}, Pairing::kBetween}};
  const Outcome brute = run_world(world, {Refit::kCab, Strategy::kRows});
  REQUIRE(brute.stats.candidates > 2 * kWaitingCandidates);
  const EnginePtr engine = make_engine_for(world);
  CHECK(same_hits(run_on(*engine, world, {Refit::kCab, Strategy::kTree}).hits, brute.hits));
}

}  // namespace cab::tests
