// The vector type V of all kernels: float (the instruction set `scalar`) or an xsimd batch of floats. DoubleOf<V> holds
// doubles in a vector of the same width in bytes. Both have only operations that give the same bits everywhere:
// + - * divide sqrt abs min max select and comparisons.
#pragma once

#include "layout/compiler.h"
#include "layout/tile.h"

#include <xsimd/xsimd.hpp>

#include <cmath>
#include <cstdint>
#include <cstring>

namespace cab::kernel {

template <class A>
using Batch = xsimd::batch<float, A>;
template <class A>
using DoubleBatch = xsimd::batch<double, A>;

template <class V>
struct DoubleOfVector;
template <>
struct DoubleOfVector<float> {
  using Type = double;
};
template <class A>
struct DoubleOfVector<Batch<A>> {
  using Type = DoubleBatch<A>;
};
template <class V>
using DoubleOf = typename DoubleOfVector<V>::Type;

// How many lanes V has. A kernel walks a tile in kLanes / kWidth<V> steps.
template <class V>
inline constexpr std::uint32_t kWidth = static_cast<std::uint32_t>(V::size);
template <>
inline constexpr std::uint32_t kWidth<float> = 1;
template <>
inline constexpr std::uint32_t kWidth<double> = 1;

// Whether V holds doubles.
template <class V>
inline constexpr bool kIsDouble = sizeof(V) == kWidth<V> * sizeof(double);

// The type of a comparison of two V.
template <class V>
struct MaskOf {
  using Type = typename V::batch_bool_type;
};
template <>
struct MaskOf<float> {
  using Type = bool;
};
template <>
struct MaskOf<double> {
  using Type = bool;
};
template <class V>
using Mask = typename MaskOf<V>::Type;

// ---------------------------------------------------------------------------------- V = float (scalar), V = double

template <class V>
struct Lanes;  // loads and stores of V

template <>
struct Lanes<float> {
  static CAB_INLINE float load(const float* at) { return *at; }
  static CAB_INLINE float load_unaligned(const float* at) { return *at; }
  static CAB_INLINE void store(float* at, float v) { *at = v; }
};

CAB_INLINE float select(bool m, float a, float b) { return m ? a : b; }
CAB_INLINE float abs(float v) { return std::fabs(v); }
CAB_INLINE float sqrt(float v) { return std::sqrt(v); }
CAB_INLINE float divide(float a, float b) { return a / b; }
CAB_INLINE float min(float a, float b) { return a < b ? a : b; }
CAB_INLINE float max(float a, float b) { return b < a ? a : b; }

// V = double. Loads of floats convert, and stores of floats round.
template <>
struct Lanes<double> {
  static CAB_INLINE double load(const float* at) { return static_cast<double>(*at); }
  static CAB_INLINE double load(const double* at) { return *at; }
  static CAB_INLINE void store(float* at, double v) { *at = static_cast<float>(v); }
  static CAB_INLINE void store(double* at, double v) { *at = v; }
};
CAB_INLINE double select(bool m, double a, double b) { return m ? a : b; }
CAB_INLINE double abs(double v) { return std::fabs(v); }
CAB_INLINE double sqrt(double v) { return std::sqrt(v); }
CAB_INLINE double divide(double a, double b) { return a / b; }
CAB_INLINE double min(double a, double b) { return a < b ? a : b; }
CAB_INLINE double max(double a, double b) { return b < a ? a : b; }

CAB_INLINE std::uint32_t bits(bool m) { return m ? 1u : 0u; }
CAB_INLINE bool both(bool a, bool b) { return a && b; }
CAB_INLINE bool either(bool a, bool b) { return a || b; }
CAB_INLINE bool without(bool a, bool b) { return a && !b; }  // a, and not b

// ------------------------------------------------------------------------------------------------ V = Batch<A>

template <class A>
struct Lanes<Batch<A>> {
  static CAB_INLINE Batch<A> load(const float* at) { return Batch<A>::load_aligned(at); }
  static CAB_INLINE Batch<A> load_unaligned(const float* at) { return Batch<A>::load_unaligned(at); }
  static CAB_INLINE void store(float* at, Batch<A> v) { v.store_aligned(at); }
};

// The floats at `at`, as doubles.
#if XSIMD_WITH_AVX512F
CAB_INLINE DoubleBatch<xsimd::avx512bw> widened(const float* at, xsimd::avx512bw) {
  return _mm512_cvtps_pd(_mm256_load_ps(at));
}
#endif
#if XSIMD_WITH_AVX2
CAB_INLINE DoubleBatch<xsimd::avx2> widened(const float* at, xsimd::avx2) { return _mm256_cvtps_pd(_mm_load_ps(at)); }
#endif
#if XSIMD_WITH_SSE2
CAB_INLINE DoubleBatch<xsimd::sse2> widened(const float* at, xsimd::sse2) {
  return _mm_cvtps_pd(_mm_castpd_ps(_mm_load_sd(reinterpret_cast<const double*>(at))));
}
#endif
#if XSIMD_WITH_NEON64
CAB_INLINE DoubleBatch<xsimd::neon64> widened(const float* at, xsimd::neon64) { return vcvt_f64_f32(vld1_f32(at)); }
#endif

// Stores doubles as floats, rounded.
#if XSIMD_WITH_AVX512F
CAB_INLINE void store_rounded(float* at, DoubleBatch<xsimd::avx512bw> v) { _mm256_store_ps(at, _mm512_cvtpd_ps(v)); }
#endif
#if XSIMD_WITH_AVX2
CAB_INLINE void store_rounded(float* at, DoubleBatch<xsimd::avx2> v) { _mm_store_ps(at, _mm256_cvtpd_ps(v)); }
#endif
#if XSIMD_WITH_SSE2
CAB_INLINE void store_rounded(float* at, DoubleBatch<xsimd::sse2> v) {
  _mm_store_sd(reinterpret_cast<double*>(at), _mm_castps_pd(_mm_cvtpd_ps(v)));
}
#endif
#if XSIMD_WITH_NEON64
CAB_INLINE void store_rounded(float* at, DoubleBatch<xsimd::neon64> v) { vst1_f32(at, vcvt_f32_f64(v)); }
#endif

// Loads of floats convert, and stores of floats round.
template <class A>
struct Lanes<DoubleBatch<A>> {
  static CAB_INLINE DoubleBatch<A> load(const float* at) { return widened(at, A{}); }
  static CAB_INLINE DoubleBatch<A> load(const double* at) { return DoubleBatch<A>::load_aligned(at); }
  static CAB_INLINE void store(float* at, DoubleBatch<A> v) { store_rounded(at, v); }
  static CAB_INLINE void store(double* at, DoubleBatch<A> v) { v.store_aligned(at); }
};

// The operations of batches of floats and of doubles. xsimd has functions of the same names for any type, so a template
// over both types would be ambiguous.
// min(a, b) is a < b ? a : b and max(a, b) is b < a ? a : b, as x86's instructions do. NEON's own differ on signed
// zeros and NaN, so NEON selects. xsimd 8.1 approximates sqrt and division on NEON (an estimate and Newton steps), so
// both use NEON's exact instructions.
#if XSIMD_WITH_NEON64
CAB_INLINE float32x4_t neon_sqrt(float32x4_t v) { return vsqrtq_f32(v); }
CAB_INLINE float64x2_t neon_sqrt(float64x2_t v) { return vsqrtq_f64(v); }
CAB_INLINE float32x4_t neon_divide(float32x4_t a, float32x4_t b) { return vdivq_f32(a, b); }
CAB_INLINE float64x2_t neon_divide(float64x2_t a, float64x2_t b) { return vdivq_f64(a, b); }
#define CAB_SQRT(v) neon_sqrt((v).data)
#define CAB_DIVIDE(a, b) neon_divide((a).data, (b).data)
#define CAB_MIN(a, b) xsimd::select((a) < (b), a, b)
#define CAB_MAX(a, b) xsimd::select((b) < (a), a, b)
#else
#define CAB_SQRT(v) xsimd::sqrt(v)
#define CAB_DIVIDE(a, b) (a) / (b)
#define CAB_MIN(a, b) xsimd::min(a, b)
#define CAB_MAX(a, b) xsimd::max(a, b)
#endif

#define CAB_BATCH_OPERATIONS(T)                                                                                 \
  template <class A>                                                                                            \
  CAB_INLINE xsimd::batch<T, A> select(xsimd::batch_bool<T, A> m, xsimd::batch<T, A> a, xsimd::batch<T, A> b) { \
    return xsimd::select(m, a, b);                                                                              \
  }                                                                                                             \
  template <class A>                                                                                            \
  CAB_INLINE xsimd::batch<T, A> abs(xsimd::batch<T, A> v) {                                                     \
    return xsimd::abs(v);                                                                                       \
  }                                                                                                             \
  template <class A>                                                                                            \
  CAB_INLINE xsimd::batch<T, A> sqrt(xsimd::batch<T, A> v) {                                                    \
    return CAB_SQRT(v);                                                                                         \
  }                                                                                                             \
  template <class A>                                                                                            \
  CAB_INLINE xsimd::batch<T, A> divide(xsimd::batch<T, A> a, xsimd::batch<T, A> b) {                            \
    return CAB_DIVIDE(a, b);                                                                                    \
  }                                                                                                             \
  template <class A>                                                                                            \
  CAB_INLINE xsimd::batch<T, A> min(xsimd::batch<T, A> a, xsimd::batch<T, A> b) {                               \
    return CAB_MIN(a, b);                                                                                       \
  }                                                                                                             \
  template <class A>                                                                                            \
  CAB_INLINE xsimd::batch<T, A> max(xsimd::batch<T, A> a, xsimd::batch<T, A> b) {                               \
    return CAB_MAX(a, b);                                                                                       \
  }                                                                                                             \
  template <class A>                                                                                            \
  CAB_INLINE xsimd::batch_bool<T, A> both(xsimd::batch_bool<T, A> a, xsimd::batch_bool<T, A> b) {               \
    return a & b;                                                                                               \
  }                                                                                                             \
  template <class A>                                                                                            \
  CAB_INLINE xsimd::batch_bool<T, A> either(xsimd::batch_bool<T, A> a, xsimd::batch_bool<T, A> b) {             \
    return a | b;                                                                                               \
  }                                                                                                             \
  template <class A>                                                                                            \
  CAB_INLINE xsimd::batch_bool<T, A> without(xsimd::batch_bool<T, A> a, xsimd::batch_bool<T, A> b) {            \
    return a & ~b;                                                                                              \
  }
#ifndef XSIMD_NO_SUPPORTED_ARCHITECTURE  // xsimd has no functions then
CAB_BATCH_OPERATIONS(float)
CAB_BATCH_OPERATIONS(double)
#endif
#undef CAB_BATCH_OPERATIONS
#undef CAB_SQRT
#undef CAB_DIVIDE
#undef CAB_MIN
#undef CAB_MAX

// One bit per lane, lane 0 lowest.
#if XSIMD_WITH_AVX512F
CAB_INLINE std::uint32_t bits(xsimd::batch_bool<float, xsimd::avx512bw> m) {
  return static_cast<std::uint32_t>(m.data);
}
CAB_INLINE std::uint32_t bits(xsimd::batch_bool<double, xsimd::avx512bw> m) {
  return static_cast<std::uint32_t>(m.data);
}
#endif
#if XSIMD_WITH_AVX2
CAB_INLINE std::uint32_t bits(xsimd::batch_bool<float, xsimd::avx2> m) {
  return static_cast<std::uint32_t>(_mm256_movemask_ps(m.data));
}
CAB_INLINE std::uint32_t bits(xsimd::batch_bool<double, xsimd::avx2> m) {
  return static_cast<std::uint32_t>(_mm256_movemask_pd(m.data));
}
#endif
#if XSIMD_WITH_SSE2
CAB_INLINE std::uint32_t bits(xsimd::batch_bool<float, xsimd::sse2> m) {
  return static_cast<std::uint32_t>(_mm_movemask_ps(m.data));
}
CAB_INLINE std::uint32_t bits(xsimd::batch_bool<double, xsimd::sse2> m) {
  return static_cast<std::uint32_t>(_mm_movemask_pd(m.data));
}
#endif
#if XSIMD_WITH_NEON64
CAB_INLINE std::uint32_t bits(xsimd::batch_bool<float, xsimd::neon64> m) {
  const uint32x4_t weights = {1, 2, 4, 8};
  return vaddvq_u32(vandq_u32(m.data, weights));
}
CAB_INLINE std::uint32_t bits(xsimd::batch_bool<double, xsimd::neon64> m) {
  const uint64x2_t weights = {1, 2};
  return static_cast<std::uint32_t>(vaddvq_u64(vandq_u64(m.data, weights)));
}
#endif

// The lanes whose bits are set: the opposite.
template <class V>
struct MaskFromBits;
template <>
struct MaskFromBits<float> {
  static CAB_INLINE bool get(std::uint32_t bits) { return bits & 1; }
};
#if XSIMD_WITH_AVX512F
template <>
struct MaskFromBits<Batch<xsimd::avx512bw>> {
  static CAB_INLINE Mask<Batch<xsimd::avx512bw>> get(std::uint32_t bits) { return static_cast<__mmask16>(bits); }
};
#endif
#if XSIMD_WITH_AVX2
template <>
struct MaskFromBits<Batch<xsimd::avx2>> {
  static CAB_INLINE Mask<Batch<xsimd::avx2>> get(std::uint32_t bits) {
    const __m256i weights = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
    const __m256i all = _mm256_set1_epi32(static_cast<int>(bits));
    return _mm256_castsi256_ps(_mm256_cmpeq_epi32(_mm256_and_si256(all, weights), weights));
  }
};
#endif
#if XSIMD_WITH_SSE2
template <>
struct MaskFromBits<Batch<xsimd::sse2>> {
  static CAB_INLINE Mask<Batch<xsimd::sse2>> get(std::uint32_t bits) {
    const __m128i weights = _mm_setr_epi32(1, 2, 4, 8), all = _mm_set1_epi32(static_cast<int>(bits));
    return _mm_castsi128_ps(_mm_cmpeq_epi32(_mm_and_si128(all, weights), weights));
  }
};
#endif
#if XSIMD_WITH_NEON64
template <>
struct MaskFromBits<Batch<xsimd::neon64>> {
  static CAB_INLINE Mask<Batch<xsimd::neon64>> get(std::uint32_t bits) {
    const uint32x4_t weights = {1, 2, 4, 8};
    return vtstq_u32(vdupq_n_u32(bits), weights);
  }
};
#endif

// The greatest lane. Lanes must not hold a NaN.
CAB_INLINE float horizontal_max(float v) { return v; }
CAB_INLINE double horizontal_max(double v) { return v; }
#if XSIMD_WITH_AVX512F
CAB_INLINE float horizontal_max(Batch<xsimd::avx512bw> v) { return _mm512_reduce_max_ps(v.data); }
#endif
#if XSIMD_WITH_SSE2
CAB_INLINE float horizontal_max(Batch<xsimd::sse2> v) {
  const __m128 pairs = _mm_max_ps(v.data, _mm_movehl_ps(v.data, v.data));
  return _mm_cvtss_f32(_mm_max_ss(pairs, _mm_shuffle_ps(pairs, pairs, 1)));
}
#endif
#if XSIMD_WITH_AVX2
CAB_INLINE float horizontal_max(Batch<xsimd::avx2> v) {
  return horizontal_max(
      Batch<xsimd::sse2>(_mm_max_ps(_mm256_castps256_ps128(v.data), _mm256_extractf128_ps(v.data, 1))));
}
#endif
#if XSIMD_WITH_NEON64
CAB_INLINE float horizontal_max(Batch<xsimd::neon64> v) { return vmaxvq_f32(v.data); }
#endif

// ------------------------------------------------------------------------------------------------------ double

// float((double)to - (double)from + by[lane]) of each lane: the difference of two points, each given relative to its
// own origin, rounded once. by: the origin of `to` less the origin of `from`, aligned like V.
CAB_INLINE float difference(float to, float from, const double* by) {
  return static_cast<float>((static_cast<double>(to) - static_cast<double>(from)) + *by);
}
#if XSIMD_WITH_SSE2
CAB_INLINE Batch<xsimd::sse2> difference(Batch<xsimd::sse2> to, Batch<xsimd::sse2> from, const double* by) {
  const __m128d lo = _mm_add_pd(_mm_sub_pd(_mm_cvtps_pd(to.data), _mm_cvtps_pd(from.data)), _mm_load_pd(by));
  const __m128d hi = _mm_add_pd(
      _mm_sub_pd(_mm_cvtps_pd(_mm_movehl_ps(to.data, to.data)), _mm_cvtps_pd(_mm_movehl_ps(from.data, from.data))),
      _mm_load_pd(by + 2));
  return _mm_movelh_ps(_mm_cvtpd_ps(lo), _mm_cvtpd_ps(hi));
}
#endif
#if XSIMD_WITH_AVX2
CAB_INLINE Batch<xsimd::avx2> difference(Batch<xsimd::avx2> to, Batch<xsimd::avx2> from, const double* by) {
  const __m256d lo = _mm256_add_pd(_mm256_sub_pd(_mm256_cvtps_pd(_mm256_castps256_ps128(to.data)),
                                                 _mm256_cvtps_pd(_mm256_castps256_ps128(from.data))),
                                   _mm256_load_pd(by));
  const __m256d hi = _mm256_add_pd(_mm256_sub_pd(_mm256_cvtps_pd(_mm256_extractf128_ps(to.data, 1)),
                                                 _mm256_cvtps_pd(_mm256_extractf128_ps(from.data, 1))),
                                   _mm256_load_pd(by + 4));
  return _mm256_insertf128_ps(_mm256_castps128_ps256(_mm256_cvtpd_ps(lo)), _mm256_cvtpd_ps(hi), 1);
}
#endif
#if XSIMD_WITH_AVX512F
CAB_INLINE Batch<xsimd::avx512bw> difference(Batch<xsimd::avx512bw> to, Batch<xsimd::avx512bw> from, const double* by) {
  const __m256 to_hi = _mm512_extractf32x8_ps(to.data, 1);
  const __m256 from_hi = _mm512_extractf32x8_ps(from.data, 1);
  const __m512d lo = _mm512_add_pd(_mm512_sub_pd(_mm512_cvtps_pd(_mm512_castps512_ps256(to.data)),
                                                 _mm512_cvtps_pd(_mm512_castps512_ps256(from.data))),
                                   _mm512_load_pd(by));
  const __m512d hi =
      _mm512_add_pd(_mm512_sub_pd(_mm512_cvtps_pd(to_hi), _mm512_cvtps_pd(from_hi)), _mm512_load_pd(by + 8));
  return _mm512_insertf32x8(_mm512_castps256_ps512(_mm512_cvtpd_ps(lo)), _mm512_cvtpd_ps(hi), 1);
}
#endif
#if XSIMD_WITH_NEON64
CAB_INLINE Batch<xsimd::neon64> difference(Batch<xsimd::neon64> to, Batch<xsimd::neon64> from, const double* by) {
  const float64x2_t lo =
      vaddq_f64(vsubq_f64(vcvt_f64_f32(vget_low_f32(to.data)), vcvt_f64_f32(vget_low_f32(from.data))), vld1q_f64(by));
  const float64x2_t hi =
      vaddq_f64(vsubq_f64(vcvt_high_f64_f32(to.data), vcvt_high_f64_f32(from.data)), vld1q_f64(by + 2));
  return vcvt_high_f32_f64(vcvt_f32_f64(lo), hi);
}
#endif

}  // namespace cab::kernel
