// The broad phase's test: which of a run of bounds rows meet one row.
#pragma once

#include "kernels/simd.h"
#include "layout/bounds_row.h"

namespace cab::kernel {

inline constexpr std::uint32_t kRowFloats = 8, kRowSides = 6;

// Vectors to compare one row, or several, with.
template <class V>
inline constexpr std::uint32_t kRowParts = (kRowSides + kWidth<V> - 1) / kWidth<V>;

// What the sides of a row that meets `of` are at most: its own with signs turned and halves swapped. As many times over as
// a vector holds rows; what is compared to a row's last two numbers means nothing.
template <class V>
CAB_INLINE void reach_of(const BoundsRow& of, V (&reach)[kRowParts<V>]) {
  alignas(64) float sides[kRowFloats] = {};
  for (std::uint32_t c = 0; c < kRowSides; ++c) sides[c] = -of.side[(c + 3) % kRowSides];
  for (std::uint32_t p = 0; p < kRowParts<V>; ++p) reach[p] = Lanes<V>::load(sides + p * kWidth<V>);
}

// In registers, since numbers that were just stored one by one are slow to load together.
#if XSIMD_WITH_AVX2
CAB_INLINE __m256 swapped_row(const BoundsRow& of) {
  const __m256 sides = _mm256_load_ps(reinterpret_cast<const float*>(&of));
  const __m256 swapped = _mm256_permutevar8x32_ps(sides, _mm256_set_epi32(7, 6, 2, 1, 0, 5, 4, 3));
  return _mm256_xor_ps(swapped, _mm256_set1_ps(-0.0f));
}
template <>
CAB_INLINE void reach_of<Batch<xsimd::avx2>>(const BoundsRow& of, Batch<xsimd::avx2> (&reach)[1]) {
  reach[0] = swapped_row(of);
}
#endif
#if XSIMD_WITH_AVX512F
template <>
CAB_INLINE void reach_of<Batch<xsimd::avx512bw>>(const BoundsRow& of, Batch<xsimd::avx512bw> (&reach)[1]) {
  const __m512d row = _mm512_castps_pd(_mm512_castps256_ps512(swapped_row(of)));
  reach[0] = _mm512_castpd_ps(_mm512_shuffle_f64x2(row, row, 0x44));
}
#endif

// Writes the indices of the rows from `first` to `end` - 1 that meet `of` to `found`, which has room for one more than
// those, and returns how many there are. One row more may be read. A NaN meets everything.
template <class V>
std::uint32_t meeting_rows(const BoundsRow* rows, std::uint32_t first, std::uint32_t end, const BoundsRow& of,
                           std::uint32_t* found) {
  constexpr std::uint32_t kUsed = (1u << kRowSides) - 1;
  constexpr std::uint32_t kRows = kWidth<V> < kRowFloats ? 1 : kWidth<V> / kRowFloats;  // rows a vector
  V reach[kRowParts<V>];
  reach_of<V>(of, reach);
  std::uint32_t size = 0;
  for (std::uint32_t i = first; i < end; i += kRows) {
    // The two numbers at a row's end are no floats: what they compare to is left out.
    const float* const sides = reinterpret_cast<const float*>(rows + i);
    std::uint32_t apart = 0;
    for (std::uint32_t p = 0; p < kRowParts<V>; ++p)
      apart |= bits(Lanes<V>::load_unaligned(sides + p * kWidth<V>) > reach[p]) << (p * kWidth<V>);
    for (std::uint32_t r = 0; r < kRows; ++r) {
      found[size] = i + r;
      size += i + r < end && (apart >> (r * kRowFloats) & kUsed) == 0;
    }
  }
  return size;
}

}  // namespace cab::kernel
