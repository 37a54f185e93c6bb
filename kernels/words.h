// Pairs of signed 16-bit words in lanes of 32 bits, for the compact bounds of leaves (layout/leaf_words.h).
#pragma once

#include "kernels/transpose.h"

#include <cstring>

namespace cab::kernel {

// As many dwords as V has lanes. plus and minus saturate. shifted divides by 2^by, rounded down. swapped exchanges the
// two words of every dword. negative: the bits of the dwords of which a word is negative. pair: dwords from whole
// numbers in floats that are not negative and below 2^31; only their lower 16 bits count. number: the bits of every
// dword that `some` has, as a number: at most 24 next to each other, without the highest.
template <class V>
struct Words;

template <>
struct Words<float> {
  using R = std::uint32_t;
  static CAB_INLINE R load(const std::uint32_t* at) { return *at; }
  static CAB_INLINE void store(std::uint32_t* at, R v) { *at = v; }
  static CAB_INLINE R all(std::uint32_t v) { return v; }
  static CAB_INLINE R any(R a, R b) { return a | b; }
  static CAB_INLINE R plus(R a, R b) { return joined(low(a) + low(b), high(a) + high(b)); }
  static CAB_INLINE R minus(R a, R b) { return joined(low(a) - low(b), high(a) - high(b)); }
  static CAB_INLINE R shifted(R a, int by) { return joined(low(a) >> by, high(a) >> by); }
  static CAB_INLINE R swapped(R a) { return a << 16 | a >> 16; }
  static CAB_INLINE std::uint32_t negative(R a) { return (a & 0x80008000u) != 0; }
  static CAB_INLINE R pair(float lower, float upper) { return (whole(lower) & 0xffffu) | whole(upper) << 16; }
  static CAB_INLINE float number(R a, std::uint32_t some) { return static_cast<float>(a & some); }

 private:
  // 0 for what is no such number, as lanes may hold that are not used.
  static CAB_INLINE std::uint32_t whole(float v) {
    return v >= 0 && v < 2147483648.0f ? static_cast<std::uint32_t>(v) : 0;
  }
  static CAB_INLINE int low(R a) { return static_cast<std::int16_t>(a); }
  static CAB_INLINE int high(R a) { return static_cast<std::int16_t>(a >> 16); }
  static CAB_INLINE int clamped(int v) { return v < -32768 ? -32768 : v > 32767 ? 32767 : v; }
  static CAB_INLINE R joined(int lower, int upper) {
    return (static_cast<std::uint32_t>(clamped(lower)) & 0xffffu) | static_cast<std::uint32_t>(clamped(upper)) << 16;
  }
};

#if XSIMD_WITH_SSE2
template <>
struct Words<Batch<xsimd::sse2>> {
  using R = __m128i;
  static CAB_INLINE R load(const std::uint32_t* at) { return _mm_loadu_si128(reinterpret_cast<const __m128i*>(at)); }
  static CAB_INLINE void store(std::uint32_t* at, R v) { _mm_storeu_si128(reinterpret_cast<__m128i*>(at), v); }
  static CAB_INLINE R all(std::uint32_t v) { return _mm_set1_epi32(static_cast<int>(v)); }
  static CAB_INLINE R any(R a, R b) { return _mm_or_si128(a, b); }
  static CAB_INLINE R plus(R a, R b) { return _mm_adds_epi16(a, b); }
  static CAB_INLINE R minus(R a, R b) { return _mm_subs_epi16(a, b); }
  static CAB_INLINE R shifted(R a, int by) { return _mm_sra_epi16(a, _mm_cvtsi32_si128(by)); }
  static CAB_INLINE R swapped(R a) { return _mm_or_si128(_mm_slli_epi32(a, 16), _mm_srli_epi32(a, 16)); }
  static CAB_INLINE std::uint32_t negative(R a) {
    return static_cast<std::uint32_t>(_mm_movemask_ps(_mm_castsi128_ps(_mm_or_si128(a, _mm_slli_epi32(a, 16)))));
  }
  static CAB_INLINE R pair(Batch<xsimd::sse2> lower, Batch<xsimd::sse2> upper) {
    const __m128i low = _mm_and_si128(_mm_cvttps_epi32(lower.data), _mm_set1_epi32(0xffff));
    return _mm_or_si128(low, _mm_slli_epi32(_mm_cvttps_epi32(upper.data), 16));
  }
  static CAB_INLINE Batch<xsimd::sse2> number(R a, std::uint32_t some) {
    return _mm_cvtepi32_ps(_mm_and_si128(a, all(some)));
  }
};
#endif

#if XSIMD_WITH_AVX2
template <>
struct Words<Batch<xsimd::avx2>> {
  using R = __m256i;
  static CAB_INLINE R load(const std::uint32_t* at) { return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(at)); }
  static CAB_INLINE void store(std::uint32_t* at, R v) { _mm256_storeu_si256(reinterpret_cast<__m256i*>(at), v); }
  static CAB_INLINE R all(std::uint32_t v) { return _mm256_set1_epi32(static_cast<int>(v)); }
  static CAB_INLINE R any(R a, R b) { return _mm256_or_si256(a, b); }
  static CAB_INLINE R plus(R a, R b) { return _mm256_adds_epi16(a, b); }
  static CAB_INLINE R minus(R a, R b) { return _mm256_subs_epi16(a, b); }
  static CAB_INLINE R shifted(R a, int by) { return _mm256_sra_epi16(a, _mm_cvtsi32_si128(by)); }
  static CAB_INLINE R swapped(R a) {
    const __m128i of_quad = _mm_set_epi8(13, 12, 15, 14, 9, 8, 11, 10, 5, 4, 7, 6, 1, 0, 3, 2);
    return _mm256_shuffle_epi8(a, _mm256_broadcastsi128_si256(of_quad));
  }
  static CAB_INLINE std::uint32_t negative(R a) {
    const __m256i signs = _mm256_or_si256(a, _mm256_slli_epi32(a, 16));
    return static_cast<std::uint32_t>(_mm256_movemask_ps(_mm256_castsi256_ps(signs)));
  }
  static CAB_INLINE R pair(Batch<xsimd::avx2> lower, Batch<xsimd::avx2> upper) {
    const __m256i high = _mm256_slli_epi32(_mm256_cvttps_epi32(upper.data), 16);
    return _mm256_blend_epi16(_mm256_cvttps_epi32(lower.data), high, 0xaa);
  }
  static CAB_INLINE Batch<xsimd::avx2> number(R a, std::uint32_t some) {
    return _mm256_cvtepi32_ps(_mm256_and_si256(a, all(some)));
  }
};
#endif

#if XSIMD_WITH_AVX512F
template <>
struct Words<Batch<xsimd::avx512bw>> {
  using R = __m512i;
  static CAB_INLINE R load(const std::uint32_t* at) { return _mm512_loadu_si512(at); }
  static CAB_INLINE void store(std::uint32_t* at, R v) { _mm512_storeu_si512(at, v); }
  static CAB_INLINE R all(std::uint32_t v) { return _mm512_set1_epi32(static_cast<int>(v)); }
  static CAB_INLINE R any(R a, R b) { return _mm512_or_si512(a, b); }
  static CAB_INLINE R plus(R a, R b) { return _mm512_adds_epi16(a, b); }
  static CAB_INLINE R minus(R a, R b) { return _mm512_subs_epi16(a, b); }
  static CAB_INLINE R shifted(R a, int by) { return _mm512_sra_epi16(a, _mm_cvtsi32_si128(by)); }
  static CAB_INLINE R swapped(R a) { return _mm512_rol_epi32(a, 16); }
  static CAB_INLINE std::uint32_t negative(R a) {
    return _mm512_test_epi32_mask(a, _mm512_set1_epi32(static_cast<int>(0x80008000u)));
  }
  static CAB_INLINE R pair(Batch<xsimd::avx512bw> lower, Batch<xsimd::avx512bw> upper) {
    const __m512i high = _mm512_slli_epi32(_mm512_cvttps_epi32(upper.data), 16);
    return _mm512_mask_blend_epi16(0xaaaaaaaau, _mm512_cvttps_epi32(lower.data), high);
  }
  static CAB_INLINE Batch<xsimd::avx512bw> number(R a, std::uint32_t some) {
    return _mm512_cvtepi32_ps(_mm512_and_si512(a, all(some)));
  }
};
#endif

#if XSIMD_WITH_NEON64
template <>
struct Words<Batch<xsimd::neon64>> {
  using R = int16x8_t;
  static CAB_INLINE R load(const std::uint32_t* at) { return vreinterpretq_s16_u32(vld1q_u32(at)); }
  static CAB_INLINE void store(std::uint32_t* at, R v) { vst1q_u32(at, vreinterpretq_u32_s16(v)); }
  static CAB_INLINE R all(std::uint32_t v) { return vreinterpretq_s16_u32(vdupq_n_u32(v)); }
  static CAB_INLINE R any(R a, R b) { return vorrq_s16(a, b); }
  static CAB_INLINE R plus(R a, R b) { return vqaddq_s16(a, b); }
  static CAB_INLINE R minus(R a, R b) { return vqsubq_s16(a, b); }
  static CAB_INLINE R shifted(R a, int by) { return vshlq_s16(a, vdupq_n_s16(static_cast<std::int16_t>(-by))); }
  static CAB_INLINE R swapped(R a) { return vrev32q_s16(a); }
  static CAB_INLINE std::uint32_t negative(R a) {
    const uint32x4_t weights = {1, 2, 4, 8};
    const uint32x4_t signs = vandq_u32(vreinterpretq_u32_s16(a), vdupq_n_u32(0x80008000u));
    return vaddvq_u32(vandq_u32(vtstq_u32(signs, signs), weights));
  }
  static CAB_INLINE R pair(Batch<xsimd::neon64> lower, Batch<xsimd::neon64> upper) {
    const uint32x4_t low = vreinterpretq_u32_s32(vcvtq_s32_f32(lower.data));
    const uint32x4_t high = vreinterpretq_u32_s32(vcvtq_s32_f32(upper.data));
    return vreinterpretq_s16_u32(vsliq_n_u32(low, high, 16));
  }
  static CAB_INLINE Batch<xsimd::neon64> number(R a, std::uint32_t some) {
    return vcvtq_f32_s32(vreinterpretq_s32_s16(vandq_s16(a, all(some))));
  }
};
#endif

// Sixteen dwords of every lane: writes those of each lane as a row.
template <class V>
CAB_INLINE void store_word_rows(const typename Words<V>::R (&fields)[kLanes], std::uint32_t* const* rows) {
  V as_floats[kLanes];
  float* to[kWidth<V>];
  for (std::uint32_t n = 0; n < kLanes; ++n) std::memcpy(&as_floats[n], &fields[n], sizeof as_floats[n]);
  for (std::uint32_t i = 0; i < kWidth<V>; ++i) to[i] = reinterpret_cast<float*>(rows[i]);
  Transpose<V>::store(as_floats, to);
}
template <>
CAB_INLINE void store_word_rows<float>(const std::uint32_t (&fields)[kLanes], std::uint32_t* const* rows) {
  for (std::uint32_t n = 0; n < kLanes; ++n) rows[0][n] = fields[n];
}

// The dword that moves words by v units, |v| < 2^15: floor(-v) in its low word, floor(v) in its high word.
CAB_INLINE std::uint32_t moving_words(double v) {
  auto whole = static_cast<std::int32_t>(v);
  whole -= static_cast<double>(whole) > v;
  const std::int32_t opposite = -whole - (static_cast<double>(whole) != v);
  return (static_cast<std::uint32_t>(opposite) & 0xffffu) | static_cast<std::uint32_t>(whole) << 16;
}

// ------------------------------------------------------------------------------------------------ numbers of bits

// The numbers of the bits of a byte that are set, from the lowest on, as bytes.
struct BitNumbers {
  std::uint8_t of[256][8];
};
constexpr BitNumbers make_bit_numbers() {
  BitNumbers out = {};
  for (std::uint32_t set = 0; set < 256; ++set)
    for (std::uint32_t bit = 0, n = 0; bit < 8; ++bit)
      if (set >> bit & 1) out.of[set][n++] = static_cast<std::uint8_t>(bit);
  return out;
}
alignas(64) constexpr BitNumbers kBitNumbers = make_bit_numbers();  // a table per file: files of several ISAs have it

// Writes one number to as many dwords as V has lanes.
template <class V>
CAB_INLINE void fill_lanes(std::uint32_t* to, std::uint32_t number) {
  Words<V>::store(to, Words<V>::all(number));
}

// Writes head + (number << shift) for every bit of `set`, of which there are sixteen. `to` has room for sixteen dwords
// after those that are written. Returns the new end.
template <class V>
CAB_INLINE std::uint32_t* append_numbers(std::uint32_t* to, std::uint32_t head, std::uint32_t shift,
                                         std::uint32_t set) {
  if constexpr (kWidth<V> == 1) {
    for (; set != 0; set &= set - 1) *to++ = head + (lowest_bit(set) << shift);
    return to;
  }
  for (std::uint32_t part = 0; part < 16; part += 8) {
    const std::uint32_t byte = set >> part & 0xff;
    for (std::uint32_t i = 0; i < 8; ++i) to[i] = head + ((kBitNumbers.of[byte][i] + part) << shift);
    to += count_bits(byte);
  }
  return to;
}
#if XSIMD_WITH_AVX2
template <>
CAB_INLINE std::uint32_t* append_numbers<Batch<xsimd::avx2>>(std::uint32_t* to, std::uint32_t head, std::uint32_t shift,
                                                             std::uint32_t set) {
  for (std::uint32_t part = 0; part < 16; part += 8) {
    const std::uint32_t byte = set >> part & 0xff;
    const __m256i numbers =
        _mm256_cvtepu8_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(kBitNumbers.of[byte])));
    const __m256i from = _mm256_set1_epi32(static_cast<int>(head + (part << shift)));
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(to),
                        _mm256_add_epi32(from, _mm256_sll_epi32(numbers, _mm_cvtsi32_si128(static_cast<int>(shift)))));
    to += count_bits(byte);
  }
  return to;
}
#endif
#if XSIMD_WITH_AVX512F
template <>
CAB_INLINE std::uint32_t* append_numbers<Batch<xsimd::avx512bw>>(std::uint32_t* to, std::uint32_t head,
                                                                 std::uint32_t shift, std::uint32_t set) {
  const __m512i numbers = _mm512_set_epi32(15, 14, 13, 12, 11, 10, 9, 8, 7, 6, 5, 4, 3, 2, 1, 0);
  const __m512i all = _mm512_add_epi32(_mm512_set1_epi32(static_cast<int>(head)),
                                       _mm512_sll_epi32(numbers, _mm_cvtsi32_si128(static_cast<int>(shift))));
  _mm512_storeu_si512(to, _mm512_maskz_compress_epi32(static_cast<__mmask16>(set), all));
  return to + count_bits(set);
}
#endif

}  // namespace cab::kernel
