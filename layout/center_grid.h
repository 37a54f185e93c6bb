// The centres of an instance's leaf boxes in few bytes: cells of a grid about them.
#pragma once

#include "layout/tile.h"

namespace cab {

// A cell (x, y, z) has its middle at low + cell (x, y, z). It is kept as one dword: x, y and z from the lowest bit on,
// kBits each.
struct CenterGrid {
  static constexpr std::uint32_t kBits = 10, kMostCell = (1 << kBits) - 1;
  static constexpr float kError = 0.875f;  // how far a centre is from the middle of its cell, in cells (step 13.6)

  float low[3];
  float cell;
};

// Makes the grid of the leaf boxes of a lane, at least one, and writes the cell of each one's centre.
inline void write_centers(Span<const BoxTile> boxes, std::uint32_t lane, CenterGrid& grid, std::uint32_t* cells) {
  constexpr float kLeastCell = 1e-30f;  // one over it is finite
  float width = 0;
  for (std::uint32_t c = 0; c < 3; ++c) {
    float low = boxes[0].center[c][lane], high = low;
    for (const BoxTile& box : boxes) {
      const float at = box.center[c][lane];
      low = at < low ? at : low;
      high = high < at ? at : high;
    }
    grid.low[c] = low;
    width = width < high - low ? high - low : width;
  }
  const float cell = width / static_cast<float>(CenterGrid::kMostCell - 1);
  grid.cell = cell < kLeastCell ? kLeastCell : cell;
  const float per_cell = 1 / grid.cell;
  for (const BoxTile& box : boxes) {
    const auto nearest = [&](std::uint32_t c) {
      return static_cast<std::uint32_t>((box.center[c][lane] - grid.low[c]) * per_cell + 0.5f);
    };
    *cells++ = nearest(0) | nearest(1) << CenterGrid::kBits | nearest(2) << 2 * CenterGrid::kBits;
  }
}

}  // namespace cab
