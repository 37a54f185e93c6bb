// Partners: what a search of the broad phase lists for one instance.
#pragma once

#include <cstdint>

namespace cab {

// The grid entry of an instance that was not looked up in the grid.
inline constexpr std::uint32_t kNoEntry = 0xffffffff;

// Another instance, and its entry in the grid.
struct Partner {
  std::uint64_t key;  // instance_key
  std::uint32_t entry;
};

// Partners of one instance that a worker keeps at a time, which does not limit how many it may have.
inline constexpr std::uint32_t kPartnerCapacity = 4096;

}  // namespace cab
