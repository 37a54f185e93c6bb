// The strategy `rows`: writes bounds of leaf boxes with leaves as lanes, and finds the leaves of two instances whose
// bounds overlap.
#pragma once

#include "kernels/few_lanes.h"
#include "kernels/simd.h"
#include "kernels/transpose.h"
#include "kernels/vec3.h"
#include "layout/compiler.h"
#include "layout/error_bounds.h"
#include "layout/leaf_bounds_soa.h"
#include "layout/pair_list.h"

#include <cassert>
#include <cstddef>

namespace cab::kernel {

static_assert(sizeof(LeafPair) == 8 && offsetof(LeafPair, b) == 6);

// bounds_to_soa, one instance after the other.
CAB_INLINE void lanes_to_soa(const AabbTile* bounds, std::uint32_t leaves, std::uint32_t live, float* soa) {
  const std::uint32_t width = leaf_bounds_width(leaves);
  for (std::uint32_t lane = 0; lane < live; ++lane)
    for (std::uint32_t side = 0; side < 6; ++side, soa += width)
      for (std::uint32_t n = 0; n < width; ++n) {
        const float none = side < 3 ? kNoLeafLo : -kNoLeafLo;
        const float(&bound)[3][kLanes] = side < 3 ? bounds[n < leaves ? n : 0].lo : bounds[n < leaves ? n : 0].hi;
        soa[n] = n < leaves ? bound[side % 3][lane] : none;
      }
}

// Writes the leaf bounds of the first `live` instances of a tile as arrays. Those of instance i start at
// soa + i * leaf_bounds_floats(leaves).
template <class V>
void bounds_to_soa(const AabbTile* bounds, std::uint32_t leaves, std::uint32_t live, float* soa) {
  const V none[2] = {V(kNoLeafLo), V(-kNoLeafLo)};
  const std::uint32_t width = leaf_bounds_width(leaves);
  if (live <= kFewLanes) return lanes_to_soa(bounds, leaves, live, soa);
  alignas(64) float unused[kLanes];
  for (std::uint32_t first = 0; first < width; first += kLanes)
    for (std::uint32_t side = 0; side < 6; ++side)
      for (std::uint32_t lane = 0; lane < live; lane += kWidth<V>) {
        V fields[kLanes];
        for (std::uint32_t n = 0; n < kLanes; ++n) {
          const AabbTile& leaf = bounds[first + n < leaves ? first + n : 0];
          const float(&bound)[3][kLanes] = side < 3 ? leaf.lo : leaf.hi;
          fields[n] = first + n < leaves ? Lanes<V>::load(bound[side % 3] + lane) : none[side / 3];
        }
        float* to[kWidth<V>];
        for (std::uint32_t i = 0; i < kWidth<V>; ++i)
          to[i] = lane + i < live ? soa + (lane + i) * leaf_bounds_floats(leaves) + std::size_t{side} * width + first
                                  : unused;
        Transpose<V>::store(fields, to);
      }
}

// Two instances whose leaf bounds are to be compared.
// a, b: the leaf bounds as arrays. begin_a, end_a: the range of a's leaves to compare; begin_a is a multiple of kLanes.
// shift: the origin of b less the origin of a, rounded to float. shift_rest: what the rounding left over.
// region: bounds relative to a's origin. A leaf of a that does not overlap them overlaps no leaf of b.
// candidate: what LeafPair::candidate of the found pairs is.
// self: a and b are one instance, and each pair of leaves is compared once.
struct RowFilter {
  const float* a;
  const float* b;
  std::uint32_t leaves_a, leaves_b;
  std::uint32_t begin_a, end_a;
  float shift[3], shift_rest[3];
  float region_lo[3], region_hi[3];
  std::uint32_t candidate;
  bool self;
  FixedList<LeafPair>* found;
};

// Writes the bounds of leaves first to first + 15 of a relative to b's origin, widened by what the move can round
// (docs/proof.md, step 4.6). Returns the bits of the leaves that overlap the region.
template <class V>
CAB_INLINE std::uint32_t move_leaves(const RowFilter& filter, std::uint32_t first, float (&lo)[3][kLanes],
                                     float (&hi)[3][kLanes]) {
  const std::uint32_t width = leaf_bounds_width(filter.leaves_a);
  std::uint32_t out = 0;
  for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>) {
    Mask<V> outside = V(0.0f) > V(0.0f);
    for (std::uint32_t c = 0; c < 3; ++c) {
      const V low = Lanes<V>::load(filter.a + std::size_t{c} * width + first + lane);
      const V high = Lanes<V>::load(filter.a + std::size_t{3 + c} * width + first + lane);
      outside = either(outside, either(low > V(filter.region_hi[c]), V(filter.region_lo[c]) > high));
      const V moved_low = (low - V(filter.shift[c])) - V(filter.shift_rest[c]);
      const V moved_high = (high - V(filter.shift[c])) - V(filter.shift_rest[c]);
      const V rest = V(kShiftPad * std::fabs(filter.shift[c]));
      Lanes<V>::store(lo[c] + lane, moved_low - (V(kMovePad) * abs(moved_low) + rest));
      Lanes<V>::store(hi[c] + lane, moved_high + (V(kMovePad) * abs(moved_high) + rest));
    }
    out |= (~bits(outside) & ((1u << kWidth<V>)-1)) << lane;
  }
  return out;
}

// Writes the pair `first` once per bit of `set`, with its b raised by the bit's index. `to` has room for kLanes pairs.
// Returns the new end.
template <class V>
CAB_INLINE LeafPair* append_pairs(LeafPair* to, LeafPair first, std::uint32_t set) {
  for (; set != 0; set &= set - 1)
    *to++ = {first.candidate, first.a, static_cast<std::uint16_t>(first.b + lowest_bit(set))};
  return to;
}
#if XSIMD_WITH_AVX512F
// Without a branch: compresses the lanes and stores all sixteen. Only the first popcount(set) are valid.
template <>
CAB_INLINE LeafPair* append_pairs<Batch<xsimd::avx512bw>>(LeafPair* to, LeafPair first, std::uint32_t set) {
  const __m512i lanes = _mm512_set_epi32(15, 14, 13, 12, 11, 10, 9, 8, 7, 6, 5, 4, 3, 2, 1, 0);
  const __m512i b = _mm512_maskz_compress_epi32(static_cast<__mmask16>(set), lanes);
  std::uint64_t base;
  std::memcpy(&base, &first, sizeof base);
  const __m512i from = _mm512_set1_epi64(static_cast<long long>(base));
  const __m512i low = _mm512_slli_epi64(_mm512_cvtepu32_epi64(_mm512_castsi512_si256(b)), 48);
  const __m512i high = _mm512_slli_epi64(_mm512_cvtepu32_epi64(_mm512_extracti64x4_epi64(b, 1)), 48);
  _mm512_storeu_si512(to, _mm512_add_epi64(from, low));
  _mm512_storeu_si512(to + 8, _mm512_add_epi64(from, high));
  return to + count_bits(set);
}
#endif

// The sides of as many leaves as a vector holds: lower bounds x y z, then upper bounds x y z.
template <class V>
struct LeafSides {
  V side[6];
};

template <class V>
CAB_INLINE LeafSides<V> load_sides(const float* soa, std::uint32_t width, std::uint32_t first) {
  LeafSides<V> out;
  for (std::uint32_t r = 0; r < 6; ++r) out.side[r] = Lanes<V>::load(soa + std::size_t{r} * width + first);
  return out;
}

// Bounds of each sixteen leaves of an instance, by side. The last ones are repeated.
struct alignas(64) BlockSides {
  float side[6][tile_count(kMaxLeaves)];
};

template <class V>
CAB_INLINE void bound_blocks(const float* soa, std::uint32_t width, BlockSides& out) {
  const std::uint32_t last = width / kLanes - 1;
  for (std::uint32_t r = 0; r < 6; ++r)
    for (std::uint32_t first = 0; first <= last; first += kWidth<V>) {
      const float* rows[kWidth<V>];
      for (std::uint32_t i = 0; i < kWidth<V>; ++i)
        rows[i] = soa + std::size_t{r} * width + kLanes * (first + i < last ? first + i : last);
      V leaf[kLanes];
      Transpose<V>::load(rows, leaf);
      for (std::uint32_t n = 1; n < kLanes; ++n) leaf[0] = r < 3 ? min(leaf[0], leaf[n]) : max(leaf[0], leaf[n]);
      Lanes<V>::store(out.side[r] + first, leaf[0]);
    }
}

// The bits of the first `count` lanes of V from lane `first` on.
template <class V>
CAB_INLINE std::uint32_t first_lanes(std::uint32_t first, std::uint32_t count) {
  return count - first < kWidth<V> ? (1u << (count - first)) - 1 : (1u << kWidth<V>)-1;
}

// From so many blocks of leaves of b on, a leaf of a is compared with the bounds of blocks first.
inline constexpr std::uint32_t kFewBlocks = 4;

// Adds every pair of leaves whose bounds overlap to filter.found, in order of (a, b). These include all pairs that pass
// the leaf predicate. The list must have room for kLanes more pairs than are added.
template <class V>
void filter_rows(const RowFilter& filter) {
  const std::uint32_t width_b = leaf_bounds_width(filter.leaves_b), blocks_b = width_b / kLanes;
  const LeafSides<V> first_b = load_sides<V>(filter.b, width_b, 0);  // all leaves of b if they fit into a vector
  BlockSides all_b;
  const bool by_blocks = blocks_b >= kFewBlocks;
  if (by_blocks) bound_blocks<V>(filter.b, width_b, all_b);
  alignas(64) float lo[3][kLanes], hi[3][kLanes];
  LeafPair* end = filter.found->end();
  for (std::uint32_t first = filter.begin_a; first < filter.end_a; first += kLanes) {
    std::uint32_t left = move_leaves<V>(filter, first, lo, hi);
    if (filter.end_a - first < kLanes) left &= (1u << (filter.end_a - first)) - 1;
    for (; left != 0; left &= left - 1) {
      const std::uint32_t i = lowest_bit(left), a = first + i;
      const V lo_x(lo[0][i]), lo_y(lo[1][i]), lo_z(lo[2][i]), hi_x(hi[0][i]), hi_y(hi[1][i]), hi_z(hi[2][i]);
      const auto overlapping = [&](const LeafSides<V>& b) {
        const V* const side = b.side;
        const Mask<V> apart =
            either(either(either(lo_x > side[3], side[0] > hi_x), either(lo_y > side[4], side[1] > hi_y)),
                   either(lo_z > side[5], side[2] > hi_z));
        return ~bits(apart);
      };
      const auto compare = [&](const LeafSides<V>& b, std::uint32_t j) {
        std::uint32_t pairs = overlapping(b) & first_lanes<V>(j, filter.leaves_b);
        if (filter.self && j <= a) pairs &= ~((2u << (a - j)) - 1);
        assert(end + kLanes <= filter.found->data + filter.found->capacity);
        end = append_pairs<V>(end, {filter.candidate, static_cast<std::uint16_t>(a), static_cast<std::uint16_t>(j)},
                              pairs);
      };
      const auto compare_from = [&](std::uint32_t j, std::uint32_t end_b) {
        for (; j < end_b && j < filter.leaves_b; j += kWidth<V>) compare(load_sides<V>(filter.b, width_b, j), j);
      };
      const std::uint32_t begin = filter.self ? a / kWidth<V> * kWidth<V> : 0;
      if (!by_blocks) {
        if (begin == 0) compare(first_b, 0);
        compare_from(begin == 0 ? kWidth<V> : begin, filter.leaves_b);
        continue;
      }
      for (std::uint32_t from = begin / kLanes / kWidth<V> * kWidth<V>; from < blocks_b; from += kWidth<V>) {
        std::uint32_t near =
            overlapping(load_sides<V>(all_b.side[0], tile_count(kMaxLeaves), from)) & first_lanes<V>(from, blocks_b);
        for (; near != 0; near &= near - 1) {
          const std::uint32_t block = kLanes * (from + lowest_bit(near));
          compare_from(block < begin ? begin : block, block + kLanes);
        }
      }
    }
  }
  filter.found->size = static_cast<std::uint32_t>(end - filter.found->data);
}

}  // namespace cab::kernel
