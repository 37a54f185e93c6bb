// Step 2 of a frame: partners, the instances that a search of the grid finds for one instance.
#pragma once

#include <cstdint>

namespace cab {

// Partner::entry of an instance that was found without the grid.
inline constexpr std::uint32_t kNoEntry = 0xffffffff;

// An instance that is paired with the one that was searched for.
struct Partner {
  std::uint64_t key;    // instance_key of the partner
  std::uint32_t entry;  // index into Grid::entries, or kNoEntry
};

// How many partners a worker lists at a time. An instance may have more: they are listed in several searches.
inline constexpr std::uint32_t kPartnerCapacity = 4096;

}  // namespace cab
