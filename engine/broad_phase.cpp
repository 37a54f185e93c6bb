#include "engine/broad_phase.h"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace cab {
namespace {

// Rounding of origin + bound in double, as a fraction of their magnitudes: docs/proof.md, step 4.4, a little over 2^-52.
constexpr double kWorldPad = 0x1p-51;

bool paired(const Engine& engine, std::uint32_t a, std::uint32_t b) {
  const std::size_t bit = std::size_t{a} * engine.batches.size() + b;
  return engine.paired_bits[bit >> 6] >> (bit & 63) & 1;
}

// Whether y or z separates two bounds.
bool apart(const InstanceBounds& a, const InstanceBounds& b) {
  return b.lo[1] > a.hi[1] || a.lo[1] > b.hi[1] || b.lo[2] > a.hi[2] || a.lo[2] > b.hi[2];
}

void set_paired(Engine& engine, std::uint32_t a, std::uint32_t b) {
  const std::size_t bit = std::size_t{a} * engine.batches.size() + b;
  engine.paired_bits[bit >> 6] |= std::uint64_t{1} << (bit & 63);
}

}  // namespace

void bound_instances(const Engine& engine, InstanceBatch& batch, std::uint32_t tile, const BoxTile* leaves) {
  AabbTile all;
  engine.kernels->bound_together(leaves, batch.articulation->leaf_count, &all);
  const std::uint32_t first = tile * kLanes;
  const std::uint32_t live = std::min(kLanes, batch.instance_count - first);
  for (std::uint32_t lane = 0; lane < live; ++lane) {
    InstanceBounds& out = batch.bounds[first + lane];
    for (std::uint32_t c = 0; c < 3; ++c) {
      const double origin = origin_of(batch, first + lane, c);
      const double lo = static_cast<double>(all.lo[c][lane]), hi = static_cast<double>(all.hi[c][lane]);
      const double pad = kWorldPad * (std::fabs(origin) + std::max(std::fabs(lo), std::fabs(hi)));
      out.lo[c] = origin + lo - pad;
      out.hi[c] = origin + hi + pad;
    }
  }
}

std::uint32_t sort_instances(Engine& engine, const FrameJob& job) {
  std::fill(engine.paired_bits.begin(), engine.paired_bits.end(), std::uint64_t{0});
  for (const PairRule& rule : job.rules) {
    if (rule.pairing != Pairing::kBetween || engine.batch(rule.a).kind != BatchKind::kCharacters) continue;
    set_paired(engine, rule.a.value - 1, rule.b.value - 1);
    set_paired(engine, rule.b.value - 1, rule.a.value - 1);
  }
  std::uint32_t count = 0;
  for (std::uint32_t index = 0; index < engine.batches.size(); ++index) {
    bool takes_part = false;
    for (std::uint32_t other = 0; other < engine.batches.size() && !takes_part; ++other)
      takes_part = paired(engine, index, other);
    if (!takes_part) continue;
    const InstanceBatch& batch = engine.batches[index]->batch;
    for (std::uint32_t instance = 0; instance < batch.instance_count; ++instance)
      if (batch.live[instance / kLanes] >> (instance % kLanes) & 1)
        engine.broad_entries[count++] = {batch.bounds[instance], index, instance};
  }
  std::sort(engine.broad_entries.data, engine.broad_entries.data + count, [](const BroadEntry& a, const BroadEntry& b) {
    return std::tie(a.bounds.lo[0], a.batch, a.instance) < std::tie(b.bounds.lo[0], b.batch, b.instance);
  });
  return count;
}

bool Partners::next(Candidate* out) {
  const BroadEntry& a = engine_.broad_entries[entry_];
  while (other_ < entry_count_) {
    const BroadEntry& b = engine_.broad_entries[other_];
    if (!all_ && b.bounds.lo[0] > a.bounds.hi[0]) return false;
    ++other_;
    if (!all_ && apart(a.bounds, b.bounds)) continue;
    if (!paired(engine_, a.batch, b.batch)) continue;
    const bool in_order = std::tie(a.batch, a.instance) < std::tie(b.batch, b.instance);
    const BroadEntry& first = in_order ? a : b;
    const BroadEntry& second = in_order ? b : a;
    *out = {first.batch, first.instance, second.batch, second.instance};
    return true;
  }
  return false;
}

}  // namespace cab
