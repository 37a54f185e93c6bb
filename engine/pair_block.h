// A block of box pairs: up to sixteen, tested by one call of a kernel.
#pragma once

#include "engine/engine.h"
#include "kernels/filter_rows.h"
#include "kernels/gather_pairs.h"

#include <cmath>

namespace cab {

template <class AosBox>
const AosBox* boxes_at(const Worker& worker, std::uint32_t slot) {
  const PosedTile& tile = worker.posed.tiles.data[slot / kLanes];
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

// Gives a filter the difference of a candidate's origins, b less a, which is kept in double as well.
inline void set_shift(const Worker& worker, const Candidate& candidate, double (&shift)[3], kernel::RowFilter& filter) {
  const auto origin = [&worker](std::uint32_t slot, std::uint32_t c) {
    return worker.posed.tiles.data[slot / kLanes].placement[slot % kLanes].origin[c];
  };
  for (std::uint32_t c = 0; c < 3; ++c) {
    shift[c] = origin(candidate.slot_b, c) - origin(candidate.slot_a, c);
    filter.shift[c] = static_cast<float>(shift[c]);
    filter.shift_rest[c] = static_cast<float>(shift[c] - static_cast<double>(filter.shift[c]));
  }
}

}  // namespace cab
