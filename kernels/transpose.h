// Register transposes: from rows of 16 floats, one row per lane, to 16 vectors, and back.
#pragma once

#include "kernels/simd.h"

namespace cab::kernel {

// How many rows one call of transpose_quads takes.
template <class V>
inline constexpr std::uint32_t kQuadRows = kWidth<V> < 4 ? 4 : kWidth<V>;

// Transposes four floats of each of kQuadRows<V> rows: out[k] receives float k of every row. Rows may have any
// alignment; out[0..3] are aligned like V. Scalar code moves the floats one by one. Part i of 128 bits of wide register
// j holds the quad of row 4 i + j, so a transpose within the parts leaves the rows in order.
template <class V>
CAB_INLINE void transpose_quads([[maybe_unused]] const float* const* rows, [[maybe_unused]] float* const (&out)[4]) {
#if XSIMD_WITH_SSE2
  __m128 a = _mm_loadu_ps(rows[0]), b = _mm_loadu_ps(rows[1]), c = _mm_loadu_ps(rows[2]), d = _mm_loadu_ps(rows[3]);
  _MM_TRANSPOSE4_PS(a, b, c, d);
  _mm_store_ps(out[0], a);
  _mm_store_ps(out[1], b);
  _mm_store_ps(out[2], c);
  _mm_store_ps(out[3], d);
#elif XSIMD_WITH_NEON64
  const float32x4_t a = vld1q_f32(rows[0]), b = vld1q_f32(rows[1]), c = vld1q_f32(rows[2]), d = vld1q_f32(rows[3]);
  const float32x4_t ac_lo = vzip1q_f32(a, c), ac_hi = vzip2q_f32(a, c), bd_lo = vzip1q_f32(b, d),
                    bd_hi = vzip2q_f32(b, d);
  vst1q_f32(out[0], vzip1q_f32(ac_lo, bd_lo));
  vst1q_f32(out[1], vzip2q_f32(ac_lo, bd_lo));
  vst1q_f32(out[2], vzip1q_f32(ac_hi, bd_hi));
  vst1q_f32(out[3], vzip2q_f32(ac_hi, bd_hi));
#endif
}
template <>
CAB_INLINE void transpose_quads<float>(const float* const* rows, float* const (&out)[4]) {
  for (int r = 0; r < 4; ++r)
    for (int k = 0; k < 4; ++k) out[k][r] = rows[r][k];
}
#if XSIMD_WITH_AVX2
template <>
CAB_INLINE void transpose_quads<Batch<xsimd::avx2>>(const float* const* rows, float* const (&out)[4]) {
  __m256 quad[4];
  for (int j = 0; j < 4; ++j)
    quad[j] = _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_loadu_ps(rows[j])), _mm_loadu_ps(rows[j + 4]), 1);
  const __m256 ab_lo = _mm256_unpacklo_ps(quad[0], quad[1]), ab_hi = _mm256_unpackhi_ps(quad[0], quad[1]);
  const __m256 cd_lo = _mm256_unpacklo_ps(quad[2], quad[3]), cd_hi = _mm256_unpackhi_ps(quad[2], quad[3]);
  _mm256_store_ps(out[0], _mm256_shuffle_ps(ab_lo, cd_lo, 0x44));
  _mm256_store_ps(out[1], _mm256_shuffle_ps(ab_lo, cd_lo, 0xee));
  _mm256_store_ps(out[2], _mm256_shuffle_ps(ab_hi, cd_hi, 0x44));
  _mm256_store_ps(out[3], _mm256_shuffle_ps(ab_hi, cd_hi, 0xee));
}
#endif
#if XSIMD_WITH_AVX512F
template <>
CAB_INLINE void transpose_quads<Batch<xsimd::avx512bw>>(const float* const* rows, float* const (&out)[4]) {
  __m512 quad[4];
  for (int j = 0; j < 4; ++j) {
    quad[j] = _mm512_castps128_ps512(_mm_loadu_ps(rows[j]));
    quad[j] = _mm512_insertf32x4(quad[j], _mm_loadu_ps(rows[j + 4]), 1);
    quad[j] = _mm512_insertf32x4(quad[j], _mm_loadu_ps(rows[j + 8]), 2);
    quad[j] = _mm512_insertf32x4(quad[j], _mm_loadu_ps(rows[j + 12]), 3);
  }
  const __m512 ab_lo = _mm512_unpacklo_ps(quad[0], quad[1]), ab_hi = _mm512_unpackhi_ps(quad[0], quad[1]);
  const __m512 cd_lo = _mm512_unpacklo_ps(quad[2], quad[3]), cd_hi = _mm512_unpackhi_ps(quad[2], quad[3]);
  _mm512_store_ps(out[0], _mm512_shuffle_ps(ab_lo, cd_lo, 0x44));
  _mm512_store_ps(out[1], _mm512_shuffle_ps(ab_lo, cd_lo, 0xee));
  _mm512_store_ps(out[2], _mm512_shuffle_ps(ab_hi, cd_hi, 0x44));
  _mm512_store_ps(out[3], _mm512_shuffle_ps(ab_hi, cd_hi, 0xee));
}
#endif

// The other way round: float k of every row is taken from in[k]. in[0..3] are aligned like V. Rows are `stride` floats
// apart from `rows` on, with any alignment.
template <class V>
CAB_INLINE void scatter_quads([[maybe_unused]] const float* const (&in)[4], [[maybe_unused]] std::size_t stride,
                              [[maybe_unused]] float* rows) {
#if XSIMD_WITH_SSE2
  __m128 a = _mm_load_ps(in[0]), b = _mm_load_ps(in[1]), c = _mm_load_ps(in[2]), d = _mm_load_ps(in[3]);
  _MM_TRANSPOSE4_PS(a, b, c, d);
  _mm_storeu_ps(rows, a);
  _mm_storeu_ps(rows + stride, b);
  _mm_storeu_ps(rows + 2 * stride, c);
  _mm_storeu_ps(rows + 3 * stride, d);
#elif XSIMD_WITH_NEON64
  const float32x4_t a = vld1q_f32(in[0]), b = vld1q_f32(in[1]), c = vld1q_f32(in[2]), d = vld1q_f32(in[3]);
  const float32x4_t ac_lo = vzip1q_f32(a, c), ac_hi = vzip2q_f32(a, c), bd_lo = vzip1q_f32(b, d),
                    bd_hi = vzip2q_f32(b, d);
  vst1q_f32(rows, vzip1q_f32(ac_lo, bd_lo));
  vst1q_f32(rows + stride, vzip2q_f32(ac_lo, bd_lo));
  vst1q_f32(rows + 2 * stride, vzip1q_f32(ac_hi, bd_hi));
  vst1q_f32(rows + 3 * stride, vzip2q_f32(ac_hi, bd_hi));
#endif
}
template <>
CAB_INLINE void scatter_quads<float>(const float* const (&in)[4], std::size_t stride, float* rows) {
  for (std::size_t r = 0; r < 4; ++r)
    for (std::size_t k = 0; k < 4; ++k) rows[r * stride + k] = in[k][r];
}
#if XSIMD_WITH_AVX2
template <>
CAB_INLINE void scatter_quads<Batch<xsimd::avx2>>(const float* const (&in)[4], std::size_t stride, float* rows) {
  const __m256 a = _mm256_load_ps(in[0]), b = _mm256_load_ps(in[1]), c = _mm256_load_ps(in[2]),
               d = _mm256_load_ps(in[3]);
  const __m256 ab_lo = _mm256_unpacklo_ps(a, b), ab_hi = _mm256_unpackhi_ps(a, b);
  const __m256 cd_lo = _mm256_unpacklo_ps(c, d), cd_hi = _mm256_unpackhi_ps(c, d);
  const __m256 quad[4] = {_mm256_shuffle_ps(ab_lo, cd_lo, 0x44), _mm256_shuffle_ps(ab_lo, cd_lo, 0xee),
                          _mm256_shuffle_ps(ab_hi, cd_hi, 0x44), _mm256_shuffle_ps(ab_hi, cd_hi, 0xee)};
  for (std::size_t j = 0; j < 4; ++j) {
    _mm_storeu_ps(rows + j * stride, _mm256_castps256_ps128(quad[j]));
    _mm_storeu_ps(rows + (j + 4) * stride, _mm256_extractf128_ps(quad[j], 1));
  }
}
#endif
#if XSIMD_WITH_AVX512F
template <>
CAB_INLINE void scatter_quads<Batch<xsimd::avx512bw>>(const float* const (&in)[4], std::size_t stride, float* rows) {
  const __m512 a = _mm512_load_ps(in[0]), b = _mm512_load_ps(in[1]), c = _mm512_load_ps(in[2]),
               d = _mm512_load_ps(in[3]);
  const __m512 ab_lo = _mm512_unpacklo_ps(a, b), ab_hi = _mm512_unpackhi_ps(a, b);
  const __m512 cd_lo = _mm512_unpacklo_ps(c, d), cd_hi = _mm512_unpackhi_ps(c, d);
  const __m512 quad[4] = {_mm512_shuffle_ps(ab_lo, cd_lo, 0x44), _mm512_shuffle_ps(ab_lo, cd_lo, 0xee),
                          _mm512_shuffle_ps(ab_hi, cd_hi, 0x44), _mm512_shuffle_ps(ab_hi, cd_hi, 0xee)};
  for (std::size_t j = 0; j < 4; ++j) {
    _mm_storeu_ps(rows + j * stride, _mm512_castps512_ps128(quad[j]));
    _mm_storeu_ps(rows + (j + 4) * stride, _mm512_extractf32x4_ps(quad[j], 1));
    _mm_storeu_ps(rows + (j + 8) * stride, _mm512_extractf32x4_ps(quad[j], 2));
    _mm_storeu_ps(rows + (j + 12) * stride, _mm512_extractf32x4_ps(quad[j], 3));
  }
}
#endif

// Transposes kWidth<V> rows of 16 floats. `rows` holds their addresses, which are aligned like V. Vector k holds float
// k of every row.
template <class V>
struct Transpose;

template <>
struct Transpose<float> {
  static CAB_INLINE void load(const float* const* rows, float* out) {
    for (int k = 0; k < 16; ++k) out[k] = rows[0][k];
  }
  static CAB_INLINE void store(const float* in, float* const* rows) {
    for (int k = 0; k < 16; ++k) rows[0][k] = in[k];
  }
};

#ifndef XSIMD_NO_SUPPORTED_ARCHITECTURE
// Four lanes: four 4x4 transposes by interleaving twice.
template <class A>
struct TransposeBy4 {
  using V = Batch<A>;
  static CAB_INLINE void square(V& a, V& b, V& c, V& d) {
    const V ac_lo = xsimd::zip_lo(a, c), ac_hi = xsimd::zip_hi(a, c);
    const V bd_lo = xsimd::zip_lo(b, d), bd_hi = xsimd::zip_hi(b, d);
    a = xsimd::zip_lo(ac_lo, bd_lo);
    b = xsimd::zip_hi(ac_lo, bd_lo);
    c = xsimd::zip_lo(ac_hi, bd_hi);
    d = xsimd::zip_hi(ac_hi, bd_hi);
  }
  static CAB_INLINE void load(const float* const* rows, V* out) {
    for (int q = 0; q < 16; q += 4) {
      for (int r = 0; r < 4; ++r) out[q + r] = V::load_aligned(rows[r] + q);
      square(out[q], out[q + 1], out[q + 2], out[q + 3]);
    }
  }
  static CAB_INLINE void store(const V* in, float* const* rows) {
    for (int q = 0; q < 16; q += 4) {
      V a = in[q], b = in[q + 1], c = in[q + 2], d = in[q + 3];
      square(a, b, c, d);
      a.store_aligned(rows[0] + q);
      b.store_aligned(rows[1] + q);
      c.store_aligned(rows[2] + q);
      d.store_aligned(rows[3] + q);
    }
  }
};
#endif

#if XSIMD_WITH_SSE2
template <>
struct Transpose<Batch<xsimd::sse2>> : TransposeBy4<xsimd::sse2> {};
#endif
#if XSIMD_WITH_NEON64
template <>
struct Transpose<Batch<xsimd::neon64>> : TransposeBy4<xsimd::neon64> {};
#endif

#if XSIMD_WITH_AVX2
// Eight lanes: two 8x8 transposes (interleave pairs, then quads, then swap halves).
template <>
struct Transpose<Batch<xsimd::avx2>> {
  using V = Batch<xsimd::avx2>;
  static CAB_INLINE void square(__m256* r) {
    __m256 pair[8], quad[8];
    for (int i = 0; i < 8; i += 2) {
      pair[i] = _mm256_unpacklo_ps(r[i], r[i + 1]);
      pair[i + 1] = _mm256_unpackhi_ps(r[i], r[i + 1]);
    }
    for (int i = 0; i < 8; i += 4) {
      quad[i] = _mm256_shuffle_ps(pair[i], pair[i + 2], 0x44);
      quad[i + 1] = _mm256_shuffle_ps(pair[i], pair[i + 2], 0xee);
      quad[i + 2] = _mm256_shuffle_ps(pair[i + 1], pair[i + 3], 0x44);
      quad[i + 3] = _mm256_shuffle_ps(pair[i + 1], pair[i + 3], 0xee);
    }
    for (int i = 0; i < 4; ++i) {
      r[i] = _mm256_permute2f128_ps(quad[i], quad[i + 4], 0x20);
      r[i + 4] = _mm256_permute2f128_ps(quad[i], quad[i + 4], 0x31);
    }
  }
  static CAB_INLINE void load(const float* const* rows, V* out) {
    for (int half = 0; half < 16; half += 8) {
      __m256 r[8];
      for (int i = 0; i < 8; ++i) r[i] = _mm256_load_ps(rows[i] + half);
      square(r);
      for (int i = 0; i < 8; ++i) out[half + i] = r[i];
    }
  }
  static CAB_INLINE void store(const V* in, float* const* rows) {
    for (int half = 0; half < 16; half += 8) {
      __m256 r[8];
      for (int i = 0; i < 8; ++i) r[i] = in[half + i].data;
      square(r);
      for (int i = 0; i < 8; ++i) _mm256_store_ps(rows[i] + half, r[i]);
    }
  }
};
#endif

#if XSIMD_WITH_AVX512F
// Sixteen lanes: one 16x16 transpose (interleave pairs, then quads, then move 128-bit quarters twice).
template <>
struct Transpose<Batch<xsimd::avx512bw>> {
  using V = Batch<xsimd::avx512bw>;
  static CAB_INLINE void square(__m512* r) {
    __m512 a[16], b[16];
    for (int i = 0; i < 16; i += 2) {
      a[i] = _mm512_unpacklo_ps(r[i], r[i + 1]);
      a[i + 1] = _mm512_unpackhi_ps(r[i], r[i + 1]);
    }
    for (int i = 0; i < 16; i += 4) {
      b[i] = _mm512_shuffle_ps(a[i], a[i + 2], 0x44);
      b[i + 1] = _mm512_shuffle_ps(a[i], a[i + 2], 0xee);
      b[i + 2] = _mm512_shuffle_ps(a[i + 1], a[i + 3], 0x44);
      b[i + 3] = _mm512_shuffle_ps(a[i + 1], a[i + 3], 0xee);
    }
    for (int i = 0; i < 4; ++i) {
      a[i] = _mm512_shuffle_f32x4(b[i], b[i + 4], 0x88);
      a[i + 4] = _mm512_shuffle_f32x4(b[i], b[i + 4], 0xdd);
      a[i + 8] = _mm512_shuffle_f32x4(b[i + 8], b[i + 12], 0x88);
      a[i + 12] = _mm512_shuffle_f32x4(b[i + 8], b[i + 12], 0xdd);
    }
    for (int i = 0; i < 8; ++i) {
      r[i] = _mm512_shuffle_f32x4(a[i], a[i + 8], 0x88);
      r[i + 8] = _mm512_shuffle_f32x4(a[i], a[i + 8], 0xdd);
    }
  }
  static CAB_INLINE void load(const float* const* rows, V* out) {
    __m512 r[16];
    for (int i = 0; i < 16; ++i) r[i] = _mm512_load_ps(rows[i]);
    square(r);
    for (int i = 0; i < 16; ++i) out[i] = r[i];
  }
  static CAB_INLINE void store(const V* in, float* const* rows) {
    __m512 r[16];
    for (int i = 0; i < 16; ++i) r[i] = in[i].data;
    square(r);
    for (int i = 0; i < 16; ++i) _mm512_store_ps(rows[i], r[i]);
  }
};
#endif

}  // namespace cab::kernel
