// Numbers of cells along a Z-order curve (Morton 1966): cells with near numbers are near each other.
#pragma once

#include <cstdint>

namespace cab {

// The lowest 21 bits of an index, with two zeros above each.
inline std::uint64_t spread_bits(std::uint64_t index) {
  index &= 0x1fffff;
  index = (index | index << 32) & 0x001f00000000ffff;
  index = (index | index << 16) & 0x001f0000ff0000ff;
  index = (index | index << 8) & 0x100f00f00f00f00f;
  index = (index | index << 4) & 0x10c30c30c30c30c3;
  return (index | index << 2) & 0x1249249249249249;
}

}  // namespace cab
