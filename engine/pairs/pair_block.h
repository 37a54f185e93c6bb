// A block of up to sixteen pairs of boxes, pairs as lanes, which one kernel call tests.
#pragma once

#include "engine/pairs/posed_set.h"
#include "kernels/filter_rows.h"
#include "kernels/gather_pairs.h"

namespace cab {

// The boxes of the instance at a slot, by node. AosBox is AabbAos with an axis-aligned refit, else BoxAos.
template <class AosBox>
const AosBox* boxes_at(const PosedSet& set, std::uint32_t slot) {
  const PosedTile& tile = set.tile_of(slot);
  return reinterpret_cast<const AosBox*>(tile.boxes) + slot % kLanes * tile.nodes;
}

// Tests the sixteen pairs of a block. Returns one bit per pair, set if its boxes overlap.
inline std::uint32_t overlap_block(const kernel::KernelTable& kernels, Sat sat, const kernel::BoxPairs<BoxAos>& pairs) {
  return kernels.overlap_boxes[static_cast<std::size_t>(sat)](pairs);
}
inline std::uint32_t overlap_block(const kernel::KernelTable& kernels, Sat, const kernel::BoxPairs<AabbAos>& pairs) {
  return kernels.overlap_aabbs(pairs);
}

// A block of box pairs. Lanes 0 to count - 1 are in use.
template <class AosBox>
struct PairBlock {
  NodePair pair[kLanes];  // by lane: the candidate and the two nodes
  std::uint32_t count = 0;
  kernel::BoxPairs<AosBox> boxes;  // by lane: the boxes of these nodes
  ShiftTile shift;                 // by lane: the origin of b less the origin of a
};

// Fills the unused lanes of a block with its first pair, which it must have.
template <class AosBox>
void pad(PairBlock<AosBox>& block) {
  for (std::uint32_t lane = block.count; lane < kLanes; ++lane) {
    block.boxes.a[lane] = block.boxes.a[0];
    block.boxes.b[lane] = block.boxes.b[0];
    for (auto& by : block.shift.by) by[lane] = by[0];
  }
}

// Writes the origin of b less the origin of a. Both instances must have slots.
inline void origin_difference(const PosedSet& set, const Candidate& candidate, double (&shift)[3]) {
  for (std::uint32_t c = 0; c < 3; ++c)
    shift[c] = set.placement(candidate.slot_b).origin[c] - set.placement(candidate.slot_a).origin[c];
}

// Sets the shift of a filter to a difference of origins: rounded to float, and the remainder as a second float.
inline void set_shift(const double (&shift)[3], kernel::RowFilter& filter) {
  for (std::uint32_t c = 0; c < 3; ++c) {
    filter.shift[c] = static_cast<float>(shift[c]);
    filter.shift_rest[c] = static_cast<float>(shift[c] - static_cast<double>(filter.shift[c]));
  }
}

}  // namespace cab
