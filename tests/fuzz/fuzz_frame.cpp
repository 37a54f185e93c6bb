// Turns bytes into worlds and runs them. No strategy loses a touching pair or reports a pair that brute does not. rows
// and links report all pairs of brute. Every instruction set writes the same bits. A masked instance is in no hit.
#include "engine/frame/all_pairs.h"
#include "perf/harness/random_world.h"
#include "tests/fuzz/bytes.h"

namespace {

using namespace cab;
using namespace cab::oracle;

World world_of(fuzz::Bytes& bytes) {
  World world;
  const std::uint32_t characters = bytes.below(3), frames = bytes.below(3);
  const std::uint32_t counts[] = {1, 2, 3, 17};
  const std::uint32_t frame_count = counts[bytes.below(4)];
  for (std::uint32_t m = 0; m < characters + frames; ++m) {
    Member member;
    member.kind = m < characters ? BatchKind::kCharacters : BatchKind::kSequence;
    member.rig = bytes.rig(4);
    // A sequence of one frame is paired with all frames of another.
    const std::uint32_t count = m < characters ? counts[bytes.below(m == 0 ? 4 : 3)] : bytes.rarely() ? 1 : frame_count;
    member.poses = bytes.poses(member.rig.link_count(), count);
    world.members.push_back(std::move(member));
  }
  pair_all(world, 1, characters);
  pair_all(world, 1 + characters, frames);
  return world;
}

std::vector<Box> boxes_of(Engine& engine, const World& world, const Policies& policies) {
  std::vector<Box> out;
  for (std::uint32_t m = 0; m < world.members.size(); ++m) {
    const Member& member = world.members[m];
    std::vector<Box> boxes(std::size_t{member.rig.node_count()} * member.poses.instance_count);
    require(compute_boxes(engine, member.poses.input({m + 1}), policies, boxes));
    out.insert(out.end(), boxes.begin(), boxes.end());
  }
  return out;
}

// The hits between characters.
std::vector<Hit> of_characters(const World& world, std::vector<Hit> hits) {
  hits.erase(std::remove_if(
                 hits.begin(), hits.end(),
                 [&](const Hit& hit) { return world.members[hit.batch_a.value - 1].kind != BatchKind::kCharacters; }),
             hits.end());
  return hits;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Bytes bytes(data, size);
  const auto extents = static_cast<Extents>(bytes.below(2));
  const Policies policies = {static_cast<Refit>(bytes.below(policy_table()[0].value_count)), Strategy::kTree,
                             Exact::kNone, extents};
  const auto exact = bytes.rarely() ? Exact::kFcl : Exact::kConvex;
  const World world = world_of(bytes);
  EnginePtr scalar;
  Outcome tree;
  try {
    scalar = make_engine_for(world, {Isa::kScalar});
    tree = run_on(*scalar, world, policies);
  } catch (const std::runtime_error&) { return 0; }  // refused by a status

  const auto masked = [&](std::size_t member, std::uint32_t i) { return tree.flags[member][i] != kInstanceOk; };
  for (const Hit& hit : tree.hits)
    FUZZ_CHECK(!masked(hit.batch_a.value - 1, hit.instance_a) && !masked(hit.batch_b.value - 1, hit.instance_b));
  FUZZ_CHECK(missing_from(judge_world(world, 0, masked), tree.hits) == 0);
  const Outcome brute = run_on(*scalar, world, {policies.refit, Strategy::kBrute, Exact::kNone, extents});
  const Outcome all = run_on(*scalar, world, policies, run_all_pairs);
  FUZZ_CHECK(missing_from(tree.hits, brute.hits) == 0 && missing_from(brute.hits, all.hits) == 0);
  const Outcome rows = run_on(*scalar, world, {policies.refit, Strategy::kRows, Exact::kNone, extents});
  const Outcome links = run_on(*scalar, world, {policies.refit, Strategy::kLinks, Exact::kNone, extents});
  FUZZ_CHECK(same_hits(rows.hits, brute.hits) && missing_from(links.hits, brute.hits) == 0);
  FUZZ_CHECK(same_hits(of_characters(world, links.hits), of_characters(world, brute.hits)));  // sequences use tree
  FUZZ_CHECK(brute.flags == tree.flags && all.flags == tree.flags && links.flags == tree.flags);

  const std::vector<Box> boxes = boxes_of(*scalar, world, policies);
  for (const Isa isa : available_isas()) {
    if (isa == Isa::kScalar) continue;
    const EnginePtr engine = make_engine_for(world, {isa});
    const Outcome other = run_on(*engine, world, policies);
    FUZZ_CHECK(same_hits(other.hits, tree.hits) && same_counts(other.stats, tree.stats) && other.flags == tree.flags);
    const std::vector<Box> other_boxes = boxes_of(*engine, world, policies);
    FUZZ_CHECK(boxes.empty() || std::memcmp(other_boxes.data(), boxes.data(), boxes.size() * sizeof(Box)) == 0);
  }
  const Policies with_exact = {policies.refit, Strategy::kTree, exact, extents};
  const Outcome confirmed = run_on(*scalar, world, with_exact);
  FUZZ_CHECK(missing_from(confirmed.hits, tree.hits) == 0);
  if (exact == Exact::kConvex) {
    for (const Isa isa : available_isas())
      FUZZ_CHECK(same_hits(run_on(*make_engine_for(world, {isa}), world, with_exact).hits, confirmed.hits));
  }
  return 0;
}
