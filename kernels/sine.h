// Sine and cosine of lanes of doubles, with the same bits on every instruction set: the operations of kernels/simd.h
// alone. Within kSineError of the true values (docs/proof.md, part 15).
#pragma once

#include "kernels/simd.h"

namespace cab::kernel {

// The largest angle that sine_cosine takes. Larger ones are reduced before.
inline constexpr double kMaxSineAngle = 1048576;  // 2^20

// The nearest integer, of two equally near ones the even one. |x| is at most 2^51.
template <class D>
CAB_INLINE D nearest_integer(D x) {
  const D shift(6755399441055744.0);  // 1.5 2^52: the sum has no bits below 1
  return (x + shift) - shift;
}

// The sine and cosine of angles in radians of at most kMaxSineAngle. NaN for NaN.
template <class D>
CAB_INLINE void sine_cosine(D angle, D* sine, D* cosine) {
  // Half pi as a sum of parts of which two have so few bits that their products with `turns` are exact.
  constexpr double kHalfPi1 = 1.5707963267341256, kHalfPi2 = 6.077100506303966e-11, kHalfPi3 = 2.0222662487959506e-21;
  constexpr double kPerHalfPi = 0.6366197723675814;
  const D turns = nearest_integer(angle * D(kPerHalfPi));
  const D r = ((angle - turns * D(kHalfPi1)) - turns * D(kHalfPi2)) - turns * D(kHalfPi3);
  const D z = r * r;
  // The terms of the Taylor series up to r^17 and r^16.
  const D s =
      r +
      r * (z * (D(-1. / 6) +
                z * (D(1. / 120) +
                     z * (D(-1. / 5040) +
                          z * (D(1. / 362880) + z * (D(-1. / 39916800) +
                                                     z * (D(1. / 6227020800) + z * (D(-1. / 1307674368000) +
                                                                                    z * D(1. / 355687428096000)))))))));
  const D c =
      D(1.) -
      (D(.5) * z -
       z * z *
           (D(1. / 24) + z * (D(-1. / 720) +
                              z * (D(1. / 40320) + z * (D(-1. / 3628800) +
                                                        z * (D(1. / 479001600) + z * (D(-1. / 87178291200) +
                                                                                      z * D(1. / 20922789888000))))))));
  // The quadrant: 0, 0.25, -0.5 or 0.5, -0.25 for 0, 1, 2, 3.
  const D quarter = turns * D(.25), part = quarter - nearest_integer(quarter);
  const auto is_odd = both(D(.1) < abs(part), abs(part) < D(.4));
  const auto turns_sine = either(part < D(-.1), D(.4) < part), turns_cosine = either(D(.1) < part, part < D(-.4));
  const D sine_of = select(is_odd, c, s), cosine_of = select(is_odd, s, c);
  *sine = select(turns_sine, D(0.) - sine_of, sine_of);
  *cosine = select(turns_cosine, D(0.) - cosine_of, cosine_of);
}

}  // namespace cab::kernel
