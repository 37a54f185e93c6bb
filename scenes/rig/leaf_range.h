// Whether an engine takes the numbers of a leaf.
#pragma once

#include "layout/shape_sizes.h"

#include <cab/types.h>

#include <algorithm>
#include <cmath>

namespace cab::scenes {

// Whether the box of a leaf and the positions and sizes of its parts are within kMaxCoordinate, and sizes above 0. The
// vertices of hulls are not looked at.
inline bool is_in_range(const Leaf& leaf) {
  const auto small = [](float value) { return std::fabs(value) <= kMaxCoordinate; };
  const auto has_size = [&small](float value) { return value > 0 && small(value); };
  const auto fits = [&](const ConvexPart& part) {
    return std::all_of(part.position, part.position + 3, small) &&
           std::all_of(part.size, part.size + size_count(part.kind), has_size);
  };
  return std::all_of(leaf.box.center, leaf.box.center + 3, small) &&
         std::all_of(leaf.box.half, leaf.box.half + 3, small) &&
         std::all_of(leaf.parts.begin(), leaf.parts.end(), fits);
}

}  // namespace cab::scenes
