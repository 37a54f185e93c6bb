// The box of the oracles: the set {center + sum x_k axis[k] : |x_k| <= half[k]}, with its stored numbers taken as
// exact.
#pragma once

#include <cstddef>
#include <limits>
#include <type_traits>

#include "perf/judge/oracle/quad.h"
#include "perf/judge/oracle/vec3.h"

namespace cab::oracle {

// Unit roundoff of float.
inline constexpr double kFloatRoundoff = 0x1p-24;

// A parallelepiped: its axes need not be exactly orthonormal, nor its half extents positive.
template <class T>
struct OracleBox {
  T center[3];
  T axis[3][3];  // axis[k][component]
  T half[3];
};

// Componentwise conversion, rounding to nearest where To is narrower than From.
template <class To, class From>
constexpr OracleBox<To> convert(const OracleBox<From>& box) {
  OracleBox<To> out{};
  for (std::size_t k = 0; k < 3; ++k) {
    out.center[k] = static_cast<To>(box.center[k]);
    out.half[k] = static_cast<To>(box.half[k]);
    for (std::size_t c = 0; c < 3; ++c) out.axis[k][c] = static_cast<To>(box.axis[k][c]);
  }
  return out;
}

// The centre, in the frame of the box's owner.
template <class T>
constexpr Vec3<T> center_of(const OracleBox<T>& box) {
  return to_vec3(box.center);
}

// Axis k in 0..2, unit to within rounding.
template <class T>
constexpr Vec3<T> axis_of(const OracleBox<T>& box, std::size_t k) {
  return to_vec3(box.axis[k]);
}

// Corner i in 0..7, computed in T: +half[k] if bit k of i is set, else -half[k].
template <class T>
constexpr Vec3<T> corner(const OracleBox<T>& box, unsigned i) {
  Vec3<T> point = center_of(box);
  for (unsigned k = 0; k < 3; ++k) {
    const T x = (i >> k & 1u) != 0 ? box.half[k] : -box.half[k];
    point = point + x * axis_of(box, k);
  }
  return point;
}

// S: the sum of the half extents.
template <class T>
constexpr T half_sum(const OracleBox<T>& box) {
  return box.half[0] + box.half[1] + box.half[2];
}

// M: the largest absolute coordinate of the centre.
template <class T>
constexpr T center_max(const OracleBox<T>& box) {
  return norm_max(center_of(box));
}

// The largest of the nine entries of |R^T R - I|, where R is the matrix of the axes. Products of floats are exact in
// double, so only additions round: for float axes near unit length the result is good to 2^-51.
template <class T>
double orthonormality_error(const OracleBox<T>& box) {
  using Wide = std::conditional_t<std::is_same_v<T, float>, double, Quad>;
  const OracleBox<Wide> exact = convert<Wide>(box);
  Wide worst = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = i; j < 3; ++j) {
      const Wide unit = i == j ? 1 : 0;
      const Wide off = magnitude(dot(axis_of(exact, i), axis_of(exact, j)) - unit);
      if (!(off <= std::numeric_limits<double>::max())) return std::numeric_limits<double>::infinity();
      worst = larger(worst, off);
    }
  }
  return static_cast<double>(worst);
}

}  // namespace cab::oracle
