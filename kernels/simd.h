// The vector type V of all kernels: float (the instruction set `scalar`), an xsimd batch, or double. V has only
// operations that give the same bits everywhere: + - * divide sqrt abs min max select and comparisons.
#pragma once

#include "layout/tile.h"

#include <xsimd/xsimd.hpp>

#include <cmath>
#include <cstdint>
#include <cstring>

#define CAB_INLINE inline __attribute__((always_inline))

namespace cab::kernel {

template <class A>
using Batch = xsimd::batch<float, A>;

// How many lanes V has. A kernel walks a tile in kLanes / kWidth<V> steps.
template <class V>
inline constexpr std::uint32_t kWidth = static_cast<std::uint32_t>(V::size);
template <>
inline constexpr std::uint32_t kWidth<float> = 1;
template <>
inline constexpr std::uint32_t kWidth<double> = 1;

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

// V = double, for second passes over single lanes. Loads convert.
template <>
struct Lanes<double> {
  static CAB_INLINE double load(const float* at) { return static_cast<double>(*at); }
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

// ------------------------------------------------------------------------------------------------ V = Batch<A>

template <class A>
struct Lanes<Batch<A>> {
  static CAB_INLINE Batch<A> load(const float* at) { return Batch<A>::load_aligned(at); }
  static CAB_INLINE Batch<A> load_unaligned(const float* at) { return Batch<A>::load_unaligned(at); }
  static CAB_INLINE void store(float* at, Batch<A> v) { v.store_aligned(at); }
};

template <class A>
CAB_INLINE Batch<A> select(xsimd::batch_bool<float, A> m, Batch<A> a, Batch<A> b) {
  return xsimd::select(m, a, b);
}
template <class A>
CAB_INLINE Batch<A> abs(Batch<A> v) {
  return xsimd::abs(v);
}
// xsimd 8.1 approximates sqrt and division on NEON (an estimate and Newton steps). Both use NEON's exact instructions
// here.
template <class A>
CAB_INLINE Batch<A> sqrt(Batch<A> v) {
#if defined(__aarch64__)
  return vsqrtq_f32(v.data);
#else
  return xsimd::sqrt(v);
#endif
}
template <class A>
CAB_INLINE Batch<A> divide(Batch<A> a, Batch<A> b) {
#if defined(__aarch64__)
  return vdivq_f32(a.data, b.data);
#else
  return a / b;
#endif
}
template <class A>
CAB_INLINE xsimd::batch_bool<float, A> both(xsimd::batch_bool<float, A> a, xsimd::batch_bool<float, A> b) {
  return a & b;
}
template <class A>
CAB_INLINE xsimd::batch_bool<float, A> either(xsimd::batch_bool<float, A> a, xsimd::batch_bool<float, A> b) {
  return a | b;
}

// min(a, b) is a < b ? a : b and max(a, b) is b < a ? a : b, as x86's instructions do. NEON's own differ on signed
// zeros and NaN, so NEON selects.
template <class A>
CAB_INLINE Batch<A> min(Batch<A> a, Batch<A> b) {
#if defined(__aarch64__)
  return xsimd::select(a < b, a, b);
#else
  return xsimd::min(a, b);
#endif
}
template <class A>
CAB_INLINE Batch<A> max(Batch<A> a, Batch<A> b) {
#if defined(__aarch64__)
  return xsimd::select(b < a, a, b);
#else
  return xsimd::max(a, b);
#endif
}

// One bit per lane, lane 0 lowest.
#if XSIMD_WITH_AVX512F
CAB_INLINE std::uint32_t bits(xsimd::batch_bool<float, xsimd::avx512bw> m) {
  return static_cast<std::uint32_t>(m.data);
}
#endif
#if XSIMD_WITH_AVX2
CAB_INLINE std::uint32_t bits(xsimd::batch_bool<float, xsimd::avx2> m) {
  return static_cast<std::uint32_t>(_mm256_movemask_ps(m.data));
}
#endif
#if XSIMD_WITH_SSE2
CAB_INLINE std::uint32_t bits(xsimd::batch_bool<float, xsimd::sse2> m) {
  return static_cast<std::uint32_t>(_mm_movemask_ps(m.data));
}
#endif
#if XSIMD_WITH_NEON64
CAB_INLINE std::uint32_t bits(xsimd::batch_bool<float, xsimd::neon64> m) {
  const uint32x4_t weights = {1, 2, 4, 8};
  return vaddvq_u32(vandq_u32(m.data, weights));
}
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
