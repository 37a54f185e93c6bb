// Compact bounds of leaves: two 16-bit words per leaf and axis, sixteen leaves in 256 bytes.
#pragma once

#include "layout/tile.h"

namespace cab {

// The bounds of up to sixteen leaves of an instance, in units of 2^exponent about the instance's origin. A dword holds
// floor(lo) in its low word and floor(-hi) in its high word, so a word never lies within its bound. Words are within
// 2^14 + 1; those of leaves that are not there are 2^15 - 1.
struct alignas(64) LeafWords {
  std::uint32_t side[3][kLanes];  // by axis and leaf
  std::uint32_t all[3];           // the same of all leaves together
  std::int32_t exponent;
  double origin[3];      // of the instance in the world
  std::uint32_t leaves;  // bits of the leaves that are there
};
static_assert(sizeof(LeafWords) == 256);

// The words' range: a bound is less than 2^kWordBits units away from the origin.
inline constexpr int kWordBits = 14;

}  // namespace cab
