// From links whose boxes overlap to their leaves: which leaf pairs are listed, and which operand comes first.
#include "engine/pairs/link_pairs.h"

#include "engine/session/call.h"
#include "engine/session/worker.h"
#include "perf/harness/world.h"

#include <doctest/doctest.h>

#include <utility>

namespace cab::tests {
namespace {

using namespace cab::oracle;
using Pairs = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

constexpr Box kUnit = {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0.5f, 0.5f, 0.5f}};

// Two links of four cubes each. Cube k of one link is at cube k of the other. Odd leaves are on link 0, even on link 1.
Rig two_rows() {
  Rig rig;
  rig.parents = {-1, 0};
  rig.parent_offset.resize(2);
  for (std::uint32_t leaf = 0; leaf < 8; ++leaf) {
    Box box = kUnit;
    box.center[0] = 2.0f * static_cast<float>(leaf / 2);
    box.center[1] = leaf % 2 == 0 ? 0.25f : 0.0f;
    rig.leaves.push_back({1 - leaf % 2, box, {}});
  }
  return rig;
}

// Two instances of a rig at the origin, bound and posed for strategy links, and the leaf pairs that a candidate lists.
struct Listed {
  World world;
  EnginePtr engine;
  std::vector<std::uint8_t> in_contact = {0, 0};
  BatchInput input;

  explicit Listed(const Rig& rig) {
    Poses poses;
    poses.link_count = rig.link_count();
    poses.instance_count = 2;
    for (std::uint32_t pose = 0; pose < 2 * rig.link_count(); ++pose)
      for (const float v : {0.0f, 0.0f, 0.0f, 1.0f, 0.0f, 0.0f, 0.0f}) poses.data.push_back(v);
    world.members = {{rig, poses}};
    engine = make_engine_for(world);
    input = world.members[0].poses.input({1});
    input.in_contact = in_contact;
  }

  Pairs pairs(std::uint32_t instance_a, std::uint32_t instance_b, const std::vector<LeafPair>& links, Exact exact,
              Report report = Report::kHits) {
    FrameJob job;
    job.report = report;
    const FrameContext frame = context_of(*engine, {Refit::kCab, Strategy::kLinks, exact}, job);
    Call call(*engine);
    call.bind(input);
    InstanceBatch& batch = engine->batch({1});
    batch.strategy = Strategy::kLinks;
    batch.active = &batch.link_bounds->links;
    Worker& worker = engine->pool[0];
    Candidate candidate = {0, instance_a, 0, instance_b};
    candidate.slot_a = acquire_slot(frame, 0, instance_a, worker.pairs.posed);
    candidate.slot_b = acquire_slot(frame, 0, instance_b, worker.pairs.posed);
    pose_set(frame, worker.pairs.posed, worker.pose);
    find_pairs_of_links(frame, candidate, links, worker.pairs, worker.stats);
    Pairs out;
    for (const LeafPair& pair : worker.pairs.found) out.emplace_back(pair.a, pair.b);
    clear_set(worker.pairs.posed);
    clear_links(worker.pairs.posed_links);
    return out;
  }
};

}  // namespace

TEST_CASE("links between instances list their leaf pairs, those of the first instance first") {
  Listed listed(two_rows());
  CHECK(listed.pairs(0, 1, {{0, 0, 1}}, Exact::kFcl) == Pairs{{1, 0}, {3, 2}, {5, 4}, {7, 6}});
  CHECK(listed.pairs(0, 1, {{0, 1, 1}}, Exact::kFcl) == Pairs{{0, 0}, {2, 2}, {4, 4}, {6, 6}});
  CHECK(listed.in_contact == std::vector<std::uint8_t>{0, 0});
}

TEST_CASE("links within an instance list the lower leaf first, whichever link has it") {
  Listed listed(two_rows());
  CHECK(listed.pairs(0, 0, {{0, 0, 1}}, Exact::kFcl) == Pairs{{0, 1}, {2, 3}, {4, 5}, {6, 7}});
}

TEST_CASE("without an exact test two links list their lowest leaf pair alone") {
  Listed listed(two_rows());
  CHECK(listed.pairs(0, 1, {{0, 0, 1}, {0, 1, 0}, {0, 1, 1}}, Exact::kNone) == Pairs{{1, 0}, {0, 1}, {0, 0}});
}

TEST_CASE("where any overlap is enough the first links that overlap end the search, and the instances are noted") {
  Listed listed(two_rows());
  CHECK(listed.pairs(0, 1, {{0, 0, 1}, {0, 1, 0}}, Exact::kNone, Report::kInContact) == Pairs{{1, 0}});
  CHECK(listed.in_contact == std::vector<std::uint8_t>{1, 1});
}

TEST_CASE("links whose leaves are apart list nothing") {
  Rig rig = two_rows();
  for (Leaf& leaf : rig.leaves)
    if (leaf.link == 1) leaf.box.center[2] = 3;
  Listed listed(rig);
  CHECK(listed.pairs(0, 1, {{0, 0, 1}}, Exact::kNone, Report::kInContact).empty());
  CHECK(listed.in_contact == std::vector<std::uint8_t>{0, 0});
}

// The predicate rounds differently with its operands exchanged, so that within its slack the two orders may disagree.
TEST_CASE(
    "within an instance links give the predicate its operands in brute's order, so both turn at the same distance") {
  std::size_t turns = 0;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    CAPTURE(seed);
    Random random(seed);
    Rig rig;
    rig.parents = {-1, 0};
    rig.parent_offset.resize(2);
    for (std::uint32_t leaf = 0; leaf < 4;
         ++leaf) {  // leaves 0 and 1 are on link 1, leaves 2 and 3 on link 0 and far away
      rig.leaves.push_back({leaf < 2 ? 1u : 0u, random_box(random, {}, 0.1, 1), {}});
      if (leaf % 2 == 1) rig.leaves.back().box.center[1] = leaf == 1 ? 40.0f : -40.0f;
    }
    World world;
    world.members = {{rig, random_poses(random, rig, 1, PoseFormat::kMatrix3x4Rows, {0.001, false, false, {}})}};
    world.rules = {{{1}, {1}, Pairing::kWithin}};
    const EnginePtr engine = make_engine_for(world);
    const auto touch = [&](float at, Strategy strategy) {
      world.members[0].poses.pose(0, 1)[3] = at;
      return !run_on(*engine, world, {Refit::kCab, strategy}).hits.empty();
    };
    float near = 0, far = 8;
    if (!touch(near, Strategy::kBrute) || touch(far, Strategy::kBrute)) continue;
    for (float middle = 4; std::nextafter(near, far) < far; middle = 0.5f * (near + far))
      (touch(middle, Strategy::kBrute) ? near : far) = middle;
    ++turns;
    float at = near;
    for (int step = 0; step < 32; ++step) at = std::nextafter(at, 0.0f);
    for (int step = 0; step < 64; ++step, at = std::nextafter(at, 8.0f))
      CHECK(touch(at, Strategy::kLinks) == touch(at, Strategy::kBrute));
  }
  CHECK(turns > 40);
}

}  // namespace cab::tests
