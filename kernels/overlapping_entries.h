// The test of the broad phase: which of the grid entries that follow each other overlap one entry.
#pragma once

#include "kernels/simd.h"
#include "layout/grid_entry.h"

namespace cab::kernel {

inline constexpr std::uint32_t kEntryFloats = 8, kEntrySides = 6;

// How many vectors the sides of one entry take: 1 if a vector holds one or more entries.
template <class V>
inline constexpr std::uint32_t kEntryVectors = (kEntrySides + kWidth<V> - 1) / kWidth<V>;

// Upper limits for the sides of an entry that overlaps `query`: the query's sides with signs flipped and halves
// swapped. They are repeated for each entry that a vector holds. The lanes of an entry's last two numbers have no
// meaning.
template <class V>
CAB_INLINE void upper_limits(const GridEntry& query, V (&limits)[kEntryVectors<V>]) {
  alignas(64) float sides[kEntryFloats] = {};
  for (std::uint32_t c = 0; c < kEntrySides; ++c) sides[c] = -query.side[(c + 3) % kEntrySides];
  for (std::uint32_t p = 0; p < kEntryVectors<V>; ++p) limits[p] = Lanes<V>::load(sides + p * kWidth<V>);
}

// These variants stay in registers, because it is slow to load numbers together that were just stored one by one.
#if XSIMD_WITH_AVX2
CAB_INLINE __m256 swapped_entry(const GridEntry& query) {
  const __m256 sides = _mm256_load_ps(reinterpret_cast<const float*>(&query));
  const __m256 swapped = _mm256_permutevar8x32_ps(sides, _mm256_set_epi32(7, 6, 2, 1, 0, 5, 4, 3));
  return _mm256_xor_ps(swapped, _mm256_set1_ps(-0.0f));
}
template <>
CAB_INLINE void upper_limits<Batch<xsimd::avx2>>(const GridEntry& query, Batch<xsimd::avx2> (&limits)[1]) {
  limits[0] = swapped_entry(query);
}
#endif
#if XSIMD_WITH_AVX512F
template <>
CAB_INLINE void upper_limits<Batch<xsimd::avx512bw>>(const GridEntry& query, Batch<xsimd::avx512bw> (&limits)[1]) {
  const __m512d entry = _mm512_castps_pd(_mm512_castps256_ps512(swapped_entry(query)));
  limits[0] = _mm512_castpd_ps(_mm512_shuffle_f64x2(entry, entry, 0x44));
}
#endif

// Writes the indices of the entries from `first` to `end` - 1 that overlap `query` to `found`, and returns their
// number. `found` has room for one more index than there are entries. One entry past the end may be read. A side that
// is NaN separates no entries.
template <class V>
std::uint32_t overlapping_entries(const GridEntry* entries, std::uint32_t first, std::uint32_t end,
                                  const GridEntry& query, std::uint32_t* found) {
  constexpr std::uint32_t kUsed = (1u << kEntrySides) - 1;
  constexpr std::uint32_t kEntries = kWidth<V> < kEntryFloats ? 1 : kWidth<V> / kEntryFloats;  // entries per vector
  V limits[kEntryVectors<V>];
  upper_limits<V>(query, limits);
  std::uint32_t size = 0;
  for (std::uint32_t i = first; i < end; i += kEntries) {
    // The last two numbers of an entry are not floats, so kUsed leaves out their comparisons.
    const float* const sides = reinterpret_cast<const float*>(entries + i);
    std::uint32_t apart = 0;
    for (std::uint32_t p = 0; p < kEntryVectors<V>; ++p)
      apart |= bits(Lanes<V>::load_unaligned(sides + p * kWidth<V>) > limits[p]) << (p * kWidth<V>);
    for (std::uint32_t r = 0; r < kEntries; ++r) {
      found[size] = i + r;
      size += i + r < end && (apart >> (r * kEntryFloats) & kUsed) == 0;
    }
  }
  return size;
}

}  // namespace cab::kernel
