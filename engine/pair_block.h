// A block of box pairs: up to sixteen, tested by one call of a kernel.
#pragma once

#include "engine/worker.h"
#include "kernels/filter_rows.h"
#include "kernels/gather_pairs.h"

#include <cmath>

namespace cab {

template <class AosBox>
const AosBox* boxes_at(const PosedSet& set, std::uint32_t slot) {
  const PosedTile& tile = set.tile_of(slot);
  return reinterpret_cast<const AosBox*>(tile.boxes) + slot % kLanes * tile.nodes;
}

// Bits of the pairs that overlap.
inline std::uint32_t overlap_block(const kernel::KernelTable& kernels, Sat sat, const kernel::BoxPairs<BoxAos>& pairs) {
  return kernels.overlap_boxes[static_cast<std::size_t>(sat)](pairs);
}
inline std::uint32_t overlap_block(const kernel::KernelTable& kernels, Sat, const kernel::BoxPairs<AabbAos>& pairs) {
  return kernels.overlap_aabbs(pairs);
}

// Up to sixteen pairs of boxes, and the differences of their origins.
template <class AosBox>
struct PairBlock {
  NodePair pair[kLanes];
  std::uint32_t count = 0;
  kernel::BoxPairs<AosBox> boxes;
  ShiftTile shift;
};

// Fills the unused lanes of a block with its first pair.
template <class AosBox>
void pad(PairBlock<AosBox>& block) {
  for (std::uint32_t lane = block.count; lane < kLanes; ++lane) {
    block.boxes.a[lane] = block.boxes.a[0];
    block.boxes.b[lane] = block.boxes.b[0];
    for (auto& by : block.shift.by) by[lane] = by[0];
  }
}

// The origin of b less that of a, of a candidate whose instances have slots.
inline void origin_difference(const PosedSet& set, const Candidate& candidate, double (&shift)[3]) {
  for (std::uint32_t c = 0; c < 3; ++c)
    shift[c] = set.placement(candidate.slot_b).origin[c] - set.placement(candidate.slot_a).origin[c];
}

// Gives a filter that difference, split into a float and what the float leaves over.
inline void set_shift(const double (&shift)[3], kernel::RowFilter& filter) {
  for (std::uint32_t c = 0; c < 3; ++c) {
    filter.shift[c] = static_cast<float>(shift[c]);
    filter.shift_rest[c] = static_cast<float>(shift[c] - static_cast<double>(filter.shift[c]));
  }
}

}  // namespace cab
