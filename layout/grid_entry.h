// Grid entry: an instance's bounds in the broad phase's grid, in half a cache line.
#pragma once

#include <cstdint>

namespace cab {

// Lower bounds x y z, then upper bounds with their signs flipped, so that one comparison by lanes tells whether two entries
// overlap: all six of one are at most the other's with signs flipped and halves swapped.
struct alignas(32) GridEntry {
  float side[6];
  std::uint32_t batch;
  std::uint32_t instance;
};
static_assert(sizeof(GridEntry) == 32);

}  // namespace cab
