// Compact bounds of leaves: made from the bounds of a tile, and compared between instances.
#pragma once

#include "kernels/rigid_leaves.h"

namespace cab::kernel {

// Floors of lo and of -hi in units of 1 / scale, as the two words of a dword. Raised by 2^16 all numbers are positive,
// so truncation rounds down and the lower 16 bits stay as they are. The 2^-6 cover the rounding of the sum, 2^-8.
template <class V>
CAB_INLINE typename Words<V>::R floor_words(V lo, V hi, V scale) {
  const V raise(65536.0f - kWordRounding);
  return Words<V>::pair(lo * scale + raise, raise - hi * scale);
}

// 2^exponent, for exponents from -126 to 127.
CAB_INLINE float power_of_two(std::int32_t exponent) {
  const std::uint32_t field = static_cast<std::uint32_t>(exponent + 127) << 23;
  float out;
  std::memcpy(&out, &field, sizeof out);
  return out;
}
CAB_INLINE double double_power_of_two(std::int32_t exponent) {
  const std::uint64_t field = static_cast<std::uint64_t>(exponent + 1023) << 52;
  double out;
  std::memcpy(&out, &field, sizeof out);
  return out;
}

// The unit of words whose bounds reach as far as `reach`: 2^out. Bounds below 2^-96 count as if they were that large.
CAB_INLINE std::int32_t words_exponent(float reach) {
  std::uint32_t field;
  std::memcpy(&field, &reach, sizeof field);
  field >>= 23;
  return static_cast<std::int32_t>(field < 31 ? 31 : field) - 126 - kWordBits;
}

// Writes the words of a tile's block, one row per lane (docs/proof.md, step 14.3). Rows of lanes that are not in
// tile.rigid have no meaning.
template <class V>
void make_leaf_words(const RigidTile& tile, LeafWords* const (&rows)[kLanes]) {
  const std::uint32_t leaves = tile.shape->block[tile.block].leaves;
  alignas(64) float scale[kLanes];
  alignas(64) float reach[kLanes];
  for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>) {
    V far(0.0f);
    for (int c = 0; c < 3; ++c)
      far = max(far,
                max(abs(Lanes<V>::load(tile.of_block.lo[c] + lane)), abs(Lanes<V>::load(tile.of_block.hi[c] + lane))));
    Lanes<V>::store(reach + lane, far);
  }
  std::int32_t exponent[kLanes];
  for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
    exponent[lane] = words_exponent(reach[lane]);
    scale[lane] = power_of_two(-exponent[lane]);
  }
  alignas(64) std::uint32_t all[3][kLanes];
  for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>) {
    const V by = Lanes<V>::load(scale + lane);
    for (int c = 0; c < 3; ++c) {
      Words<V>::store(all[c] + lane, floor_words<V>(Lanes<V>::load(tile.of_block.lo[c] + lane),
                                                    Lanes<V>::load(tile.of_block.hi[c] + lane), by));
      typename Words<V>::R fields[kLanes];
      for (std::uint32_t leaf = 0; leaf < kLanes; ++leaf)
        fields[leaf] = leaf < leaves ? floor_words<V>(Lanes<V>::load(tile.lo[leaf][c] + lane),
                                                      Lanes<V>::load(tile.hi[leaf][c] + lane), by)
                                     : Words<V>::all(0x7fff7fffu);
      std::uint32_t* to[kWidth<V>];
      for (std::uint32_t i = 0; i < kWidth<V>; ++i) to[i] = rows[lane + i]->side[c];
      store_word_rows<V>(fields, to);
    }
  }
  for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
    LeafWords& row = *rows[lane];
    for (int c = 0; c < 3; ++c) row.all[c] = all[c][lane];
    row.exponent = exponent[lane];
    row.leaves = (2u << (leaves - 1)) - 1;
  }
}

// Entries to filter: row a[i] with row b[i]. head[i]: the first leaf of a's block << 8 | that of b's. size: how large
// a leaf's box is at most, of all a and of all b together (docs/proof.md, step 14.5).
struct WordEntries {
  const LeafWords* const* a;
  const LeafWords* const* b;
  const std::uint32_t* head;
  std::uint32_t count;
  float size;
};

// How far b's origin is from a's, in words of a unit: as moving_words has it, by axis. Writes the difference to the
// slots. Returns whether the words of both can meet at all; if not, the moves have no meaning.
template <class V>
CAB_INLINE bool move_between(const LeafWords& a, const LeafWords& b, std::int32_t exponent, std::uint32_t slot,
                             PairSlots& slots, std::uint32_t (&move)[4]) {
  const double unit = double_power_of_two(-exponent);
  bool near = true;
#if XSIMD_WITH_AVX2
  if constexpr (kWidth<V> >= 8) {  // three axes at a time; what is behind the origin fills the fourth lane
    const __m256d by = _mm256_sub_pd(_mm256_loadu_pd(b.origin), _mm256_loadu_pd(a.origin));
    _mm256_storeu_pd(slots.exact_shift[slot], by);
    const __m128 rounded = _mm256_cvtpd_ps(by);
    _mm_store_ss(slots.shift[0] + slot, rounded);
    _mm_store_ss(slots.shift[1] + slot, _mm_movehdup_ps(rounded));
    _mm_store_ss(slots.shift[2] + slot, _mm_movehl_ps(rounded, rounded));
    const __m256d words = _mm256_mul_pd(by, _mm256_set1_pd(unit));
    const __m256d size = _mm256_andnot_pd(_mm256_set1_pd(-0.0), words);
    near = (_mm256_movemask_pd(_mm256_cmp_pd(size, _mm256_set1_pd(32768.0), _CMP_LT_OQ)) & 7) == 7;
    const __m128i up = _mm256_cvtpd_epi32(_mm256_floor_pd(words));
    const __m128i down = _mm256_cvtpd_epi32(_mm256_floor_pd(_mm256_sub_pd(_mm256_setzero_pd(), words)));
    _mm_storeu_si128(reinterpret_cast<__m128i*>(move), _mm_blend_epi16(down, _mm_slli_epi32(up, 16), 0xaa));
    return near;
  }
#endif
  for (int c = 0; c < 3; ++c) {
    const double by = b.origin[c] - a.origin[c], words = by * unit;
    slots.exact_shift[slot][c] = by;
    slots.shift[c][slot] = static_cast<float>(by);
    const bool in_reach = words < 32768.0 && words > -32768.0;
    near = near && in_reach;
    move[c] = moving_words(in_reach ? words : 0);
  }
  return near;
}

// Appends the leaf pairs whose bounds overlap, as overlap_rigid_leaves takes them, to `to`, in the order of entries and
// leaves, and gives each entry that has some a slot. These include all pairs that pass the leaf predicate. `to` has
// room for 256 dwords per entry and 16 more. Returns the number of pairs; *used becomes that of slots.
template <class V>
std::uint32_t overlapping_words(const WordEntries& entries, PairSlots& slots, std::uint32_t* to, std::uint32_t* used) {
  using W = Words<V>;
  using R = typename W::R;
  constexpr std::uint32_t kBlock = 32, kParts = kLanes / kWidth<V>;
  alignas(64) std::uint32_t reach[kBlock][3][kLanes];
  alignas(64) std::uint32_t moved_b[kBlock][3][kLanes];
  std::uint32_t leaves_b[kBlock];
  std::uint32_t items[kBlock * kLanes + kLanes];
  const R zero = W::all(0);
  std::uint32_t* const begin = to;
  std::uint32_t slot = 0;
  for (std::uint32_t first = 0; first < entries.count; first += kBlock) {
    const std::uint32_t n = entries.count - first < kBlock ? entries.count - first : kBlock, first_slot = slot;
    std::uint32_t* item = items;
    for (std::uint32_t i = 0; i < n; ++i) {
      const LeafWords &a = *entries.a[first + i], &b = *entries.b[first + i];
      const std::int32_t exponent = a.exponent > b.exponent ? a.exponent : b.exponent;
      const int fall_a = exponent - a.exponent < 15 ? exponent - a.exponent : 15;
      const int fall_b = exponent - b.exponent < 15 ? exponent - b.exponent : 15;
      const std::uint32_t local = slot - first_slot;
      std::uint32_t moves[4];
      const bool near = move_between<V>(a, b, exponent, slot, slots, moves);
      R apart[kParts], apart_b[kParts];
      for (std::uint32_t p = 0; p < kParts; ++p) apart[p] = apart_b[p] = zero;
      for (int c = 0; c < 3; ++c) {
        const R move = W::all(moves[c]);
        const R all_b = W::shifted(W::all(b.all[c]), fall_b);
        const R all_a = W::minus(zero, W::swapped(W::plus(W::shifted(W::all(a.all[c]), fall_a), move)));
        for (std::uint32_t p = 0; p < kParts; ++p) {
          const std::uint32_t at = p * kWidth<V>;
          const R of_a = W::minus(zero, W::swapped(W::plus(W::shifted(W::load(a.side[c] + at), fall_a), move)));
          const R of_b = W::shifted(W::load(b.side[c] + at), fall_b);
          W::store(reach[local][c] + at, of_a);
          W::store(moved_b[local][c] + at, of_b);
          apart[p] = W::any(apart[p], W::minus(of_a, all_b));
          apart_b[p] = W::any(apart_b[p], W::minus(all_a, of_b));
        }
      }
      std::uint32_t left = a.leaves, right = b.leaves;
      for (std::uint32_t p = 0; p < kParts; ++p) {
        left &= ~(W::negative(apart[p]) << p * kWidth<V>);
        right &= ~(W::negative(apart_b[p]) << p * kWidth<V>);
      }
      const std::uint32_t take = static_cast<std::uint32_t>(near) & static_cast<std::uint32_t>(left != 0) &
                                 static_cast<std::uint32_t>(right != 0);
      slots.unsure[slot] =
          kRigidUnsureSize * entries.size +
          kRigidUnsureCenter * (power_of_two(a.exponent + kWordBits) + power_of_two(b.exponent + kWordBits));
      slots.entry[slot] = first + i;
      leaves_b[local] = right;
      item = append_numbers<V>(item, slot << 16 | entries.head[first + i], 8, left & (0u - take));
      slot += take;
    }
    for (const std::uint32_t* one = items; one != item; ++one) {
      const std::uint32_t local = slot_of(*one) - first_slot, leaf = leaf_a_of(*one) % kLanes;
      const R x = W::all(reach[local][0][leaf]), y = W::all(reach[local][1][leaf]), z = W::all(reach[local][2][leaf]);
      std::uint32_t meet = leaves_b[local];
      for (std::uint32_t p = 0; p < kParts; ++p) {
        const std::uint32_t at = p * kWidth<V>;
        const R gap =
            W::any(W::any(W::minus(x, W::load(moved_b[local][0] + at)), W::minus(y, W::load(moved_b[local][1] + at))),
                   W::minus(z, W::load(moved_b[local][2] + at)));
        meet &= ~(W::negative(gap) << at);
      }
      to = append_numbers<V>(to, *one, 0, meet);
    }
  }
  *used = slot;
  return static_cast<std::uint32_t>(to - begin);
}

}  // namespace cab::kernel
