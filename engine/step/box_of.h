// The box of one instance out of a tile.
#pragma once

#include "engine/step/instance_batch.h"
#include "engine/step/pose_scratch.h"
#include "layout/tile.h"

#include <cab/types.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace cab {

// The box of one lane.
inline Box box_of(const BoxTile& tile, std::uint32_t lane) {
  Box box;
  for (int c = 0; c < 3; ++c) {
    box.center[c] = tile.center[c][lane];
    box.half[c] = tile.half[c][lane];
    for (int k = 0; k < 3; ++k) box.axis[k][c] = tile.axis[k][c][lane];
  }
  return box;
}

// The bounds of one lane as a box with world axes. Its half extents are rounded up, so that it contains the bounds.
inline Box box_of(const AabbTile& tile, std::uint32_t lane) {
  Box box = {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0, 0, 0}};
  for (int c = 0; c < 3; ++c) {
    const double lo = static_cast<double>(tile.lo[c][lane]), hi = static_cast<double>(tile.hi[c][lane]);
    box.center[c] = static_cast<float>(0.5 * (lo + hi));
    const double half = std::max(hi - static_cast<double>(box.center[c]), static_cast<double>(box.center[c]) - lo);
    box.half[c] = static_cast<float>(half);
    if (static_cast<double>(box.half[c]) < half)
      box.half[c] = std::nextafter(box.half[c], std::numeric_limits<float>::infinity());
  }
  return box;
}

// The box of a node of one lane in the tile that was updated by a refit.
inline Box box_of(const PoseScratch& posed, Refit refit, std::size_t node, std::uint32_t lane) {
  return is_axis_aligned(refit) ? box_of(posed.bounds[node], lane) : box_of(posed.boxes[node], lane);
}

}  // namespace cab
