// The bounds of one instance's leaf boxes as a structure of arrays, leaves as lanes. It serves tests of one box against
// all boxes of another instance.
#pragma once

#include "layout/tile.h"

#include <cstddef>
#include <cstdint>

namespace cab {

// A padding leaf has lo = +FLT_MAX and hi = -FLT_MAX, and overlaps nothing.
inline constexpr float kNoLeafLo = 3.402823466e38f;

// Floats in one of the six arrays: the number of leaves, rounded up to whole tiles.
inline constexpr std::uint32_t leaf_bounds_width(std::uint32_t leaves) { return tile_count(leaves) * kLanes; }

// Floats per instance: arrays lo x, lo y, lo z, hi x, hi y, hi z.
inline constexpr std::size_t leaf_bounds_floats(std::uint32_t leaves) {
  return std::size_t{6} * leaf_bounds_width(leaves);
}

}  // namespace cab
