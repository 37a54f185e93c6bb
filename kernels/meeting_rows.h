// The broad phase's test: which of a run of bounds rows meet the bounds of one instance.
#pragma once

#include "kernels/simd.h"
#include "layout/bounds_row.h"

namespace cab::kernel {

// Writes the indices of the rows whose six sides are at most `reach` (8 floats, the last two unused) to `found`, which has
// room for `count`, and returns how many there are. One row more than `count` may be read. A NaN meets everything.
template <class V>
std::uint32_t meeting_rows(const BoundsRow* rows, std::uint32_t count, const float* reach, std::uint32_t* found) {
  constexpr std::uint32_t kSides = 8, kUsed = 0x3f;
  constexpr std::uint32_t kParts = (6 + kWidth<V> - 1) / kWidth<V>;             // vectors a row
  constexpr std::uint32_t kRows = kWidth<V> < kSides ? 1 : kWidth<V> / kSides;  // rows a vector
  alignas(64) float twice[2 * kSides];
  std::memcpy(twice, reach, sizeof twice / 2);
  std::memcpy(twice + kSides, reach, sizeof twice / 2);
  V limit[kParts];
  for (std::uint32_t p = 0; p < kParts; ++p) limit[p] = Lanes<V>::load(twice + p * kWidth<V>);
  std::uint32_t size = 0;
  for (std::uint32_t i = 0; i < count; i += kRows) {
    // The two numbers at a row's end are no floats: what they compare to is left out.
    const float* const sides = reinterpret_cast<const float*>(rows + i);
    std::uint32_t apart = 0;
    for (std::uint32_t p = 0; p < kParts; ++p)
      apart |= bits(Lanes<V>::load_unaligned(sides + p * kWidth<V>) > limit[p]) << (p * kWidth<V>);
    for (std::uint32_t r = 0; r < kRows; ++r) {
      found[size] = i + r;
      size += i + r < count && (apart >> (r * kSides) & kUsed) == 0;
    }
  }
  return size;
}

}  // namespace cab::kernel
