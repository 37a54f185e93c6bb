#include "engine/broad_phase/pair_rules.h"

#include <algorithm>

namespace cab {
namespace {

// Records that a rule pairs batch a with batch b.
void set_paired(StoredBatches batches, std::uint32_t a, std::uint32_t b, Resting resting, PairedBatches& out) {
  const std::size_t bit = a * out.count + b;
  const std::uint64_t mask = std::uint64_t{1} << (bit & 63);
  out.bits[bit >> 6] |= mask;
  if (resting == Resting::kSkipped) out.skipped[bit >> 6] |= mask;
  batches[a]->batch.pairs_between = true;
}

}  // namespace

void note_rules(Span<const PairRule> rules, StoredBatches batches, PairedBatches& out) {
  std::fill(out.bits.begin(), out.bits.end(), std::uint64_t{0});
  std::fill(out.skipped.begin(), out.skipped.end(), std::uint64_t{0});
  out.reports_resting = false;
  for (const PairRule& rule : rules) {
    const std::uint32_t a = slot_of(rule.a).value - 1, b = slot_of(rule.b).value - 1;
    if (batches[a]->batch.kind != BatchKind::kCharacters) continue;
    const bool may_rest = batches[a]->batch.may_rest && batches[b]->batch.may_rest;
    out.reports_resting = out.reports_resting || (may_rest && rule.resting == Resting::kReported);
    if (rule.pairing == Pairing::kWithin) {
      batches[a]->batch.pairs_within = true;
      batches[a]->batch.skips_within = rule.resting == Resting::kSkipped;
    } else {
      set_paired(batches, a, b, rule.resting, out);
      set_paired(batches, b, a, rule.resting, out);
    }
  }
}

}  // namespace cab
