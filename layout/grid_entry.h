// A grid entry: an instance's bounds in the grid of the broad phase, in half a cache line.
#pragma once

#include <cstdint>

namespace cab {

// Lower bounds x y z, then upper bounds x y z with their signs flipped. One comparison by lanes then tells whether two
// entries overlap: each side of one is at most the other's, with the other's signs flipped and its halves swapped.
struct alignas(32) GridEntry {
  float side[6];
  std::uint32_t batch;
  std::uint32_t instance;
};
static_assert(sizeof(GridEntry) == 32);

}  // namespace cab
