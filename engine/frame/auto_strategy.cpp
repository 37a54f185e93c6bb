// Resolves the strategy `auto`: compares counts of a frame with the crossovers between strategies.
#include "engine/frame/auto_strategy.h"

#include <algorithm>

namespace cab {
namespace {

// The crossovers below were measured on one core, with AVX-512 and with SSE2. docs/policies.md, "Crossovers", has the
// figures.

// Up to this many links with leaves, `rows` pairs two chains faster than `tree` does, unless they lie straight. Bodies
// that branch are compact: there `rows` is faster at any number of links. With axis-aligned boxes, which boxes of links
// do not bound, leaves are counted instead of links.
constexpr std::uint32_t kRowsMaxLinksOfChain = 128;

// From this many leaves on, `links` pairs a character with several leaves on some link faster than `rows` does.
constexpr std::uint32_t kLinksMinLeaves = 49;

// Sequences: `tree` is faster than `brute` if the rules have more leaf pairs than it costs. Its cost, in tests of leaf
// pairs with sixteen animation frames as lanes, is pair_tests_per_merge() per inner node for the refit and
// kDescentPairTests for the descent.
constexpr std::uint64_t kDescentPairTests = 64;
std::uint64_t pair_tests_per_merge(Refit refit) {
  switch (refit) {
    case Refit::kAabbHull: return 1;
    case Refit::kCab:
    case Refit::kBest3:
    case Refit::kCabSum:
    case Refit::kAabbVertices: return 8;
    case Refit::kCovariance: return 64;
  }
  return 8;
}

// The strategy for the characters of a batch.
Strategy strategy_of(const InstanceBatch& batch, const Policies& policies) {
  const Articulation& articulation = *batch.articulation;
  const bool axis_aligned = is_axis_aligned(policies.refit);
  const bool has_link_boxes = batch.link_bounds->has_several_leaves && !axis_aligned && articulation.skin.empty();
  if (policies.strategy == Strategy::kLinks) return has_link_boxes ? Strategy::kLinks : Strategy::kRows;
  if (policies.strategy != Strategy::kAuto) return policies.strategy;
  const std::uint32_t links = axis_aligned ? articulation.leaf_count : batch.link_bounds->links.leaf_count;
  if (articulation.is_chain && links > kRowsMaxLinksOfChain) return Strategy::kTree;
  return has_link_boxes && articulation.leaf_count >= kLinksMinLeaves ? Strategy::kLinks : Strategy::kRows;
}

// The number of leaf pairs that a rule tests per animation frame.
std::uint64_t leaf_pairs_of(const Engine& engine, const PairRule& rule) {
  const Articulation &a = *engine.batch(rule.a).articulation, &b = *engine.batch(rule.b).articulation;
  return rule.pairing == Pairing::kWithin ? a.leaf_pairs_within : std::uint64_t{a.leaf_count} * b.leaf_count;
}

}  // namespace

Policies resolve_characters(Engine& engine, const FrameJob& job) {
  Policies out = job.policies;
  bool first = true;
  for (const BatchInput& input : job.inputs) {
    InstanceBatch& batch = engine.batch(input.batch);
    if (batch.kind != BatchKind::kCharacters) continue;
    batch.strategy = strategy_of(batch, job.policies);
    if (batch.strategy == Strategy::kLinks) batch.active = &batch.link_bounds->links;
    out.strategy = first || batch.strategy == out.strategy ? batch.strategy : Strategy::kAuto;
    first = false;
  }
  return out;
}

Policies resolve_sequences(const Engine& engine, const FrameJob& job) {
  Policies out = job.policies;
  if (out.strategy == Strategy::kLinks) out.strategy = Strategy::kTree;
  if (out.strategy != Strategy::kAuto) return out;
  std::uint64_t leaf_pairs = 0, inner_nodes = 0;
  for (const PairRule& rule : job.rules)
    if (engine.batch(rule.a).kind == BatchKind::kSequence) leaf_pairs += leaf_pairs_of(engine, rule);
  for (const BatchInput& input : job.inputs)
    if (const InstanceBatch& batch = engine.batch(input.batch); batch.kind == BatchKind::kSequence)
      inner_nodes += batch.articulation->leaf_count - 1;
  const bool tree = leaf_pairs > pair_tests_per_merge(out.refit) * inner_nodes + kDescentPairTests;
  out.strategy = tree ? Strategy::kTree : Strategy::kBrute;
  return out;
}

// Measured with uniform crowds and two threads of TBB. Starting the threads takes about 5 microseconds for each of a
// frame's parallel loops. At about 300 characters one and two threads take the same time.
bool runs_on_one_thread(const Engine& engine, const FrameJob& job, const Policies& policies) {
  constexpr std::uint32_t kSmall = 320;
  if (policies.strategy != Strategy::kRows || policies.exact != Exact::kNone) return false;
  std::uint32_t count = 0;
  for (const BatchInput& input : job.inputs) {
    const InstanceBatch& batch = engine.batch(input.batch);
    if (batch.kind != BatchKind::kCharacters) return false;
    count += std::min(batch.instance_count, kSmall + 1);
    if (count > kSmall) return false;
  }
  return true;
}

}  // namespace cab
