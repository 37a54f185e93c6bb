#include "engine/auto_strategy.h"

#include <algorithm>

namespace cab {
namespace {

// The crossovers below were measured on one core with AVX-512 and SSE2: docs/policies.md, "Crossovers".

// Up to this many links with leaves `rows` pair a character faster than its tree does; up to fewer where the links are
// one chain. With axis-aligned boxes, which no link's box stands for, leaves are counted.
constexpr std::uint32_t kRowsMaxLinks = 64;
constexpr std::uint32_t kRowsMaxLinksOfChain = 47;

// From this many leaves on `links` pair a character that has several leaves on some link faster than `rows` do.
constexpr std::uint32_t kLinksMinLeaves = 49;

// A tree pays in a sequence from this many leaf pairs on for every inner node that is refitted, and some for the
// descent itself: what a merge costs in pair tests, sixteen frames as lanes.
constexpr std::uint64_t kTreeLeafPairs = 64;
std::uint64_t pairs_a_merge(Refit refit) {
  switch (refit) {
    case Refit::kAabbHull: return 1;
    case Refit::kCovariance:
    case Refit::kCovarianceLeaves: return 64;
    default: return 8;
  }
}

std::uint64_t leaf_pairs_of(const Engine& engine, const PairRule& rule) {
  const std::uint64_t a = engine.batch(rule.a).articulation->leaf_count,
                      b = engine.batch(rule.b).articulation->leaf_count;
  return rule.pairing == Pairing::kWithin ? a * (a - 1) / 2 : a * b;
}

}  // namespace

Policies resolve_characters(const Engine& engine, const FrameJob& job) {
  Policies out = job.policies;
  const bool axis_aligned = is_axis_aligned(out.refit);
  bool several_leaves = false, links_pay = false, tree_pays = false;
  for (const BatchInput& input : job.inputs) {
    const InstanceBatch& batch = engine.batch(input.batch);
    if (batch.kind != BatchKind::kCharacters) continue;
    const std::uint32_t leaves = batch.articulation->leaf_count;
    several_leaves = several_leaves || batch.link_bounds->has_several_leaves;
    links_pay = links_pay || (batch.link_bounds->has_several_leaves && leaves >= kLinksMinLeaves);
    const std::uint32_t rows_most = batch.articulation->is_chain ? kRowsMaxLinksOfChain : kRowsMaxLinks;
    tree_pays = tree_pays || (axis_aligned ? leaves : batch.link_bounds->links.leaf_count) > rows_most;
  }
  if (out.strategy == Strategy::kAuto)
    out.strategy = tree_pays ? Strategy::kTree : links_pay ? Strategy::kLinks : Strategy::kRows;
  // Boxes of links say nothing about axis-aligned leaves, which may reach out of them.
  if (out.strategy == Strategy::kLinks && (!several_leaves || axis_aligned)) out.strategy = Strategy::kRows;
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
  const bool tree = leaf_pairs > pairs_a_merge(out.refit) * inner_nodes + kTreeLeafPairs;
  out.strategy = tree ? Strategy::kTree : Strategy::kBrute;
  return out;
}

// Measured with uniform crowds and two threads of TBB, whose start takes about 5 microseconds for each of a frame's five
// loops: they are even at about 300 characters.
bool is_small(const Engine& engine, const FrameJob& job, const Policies& policies) {
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
