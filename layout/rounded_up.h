// Rounding from double to float that never makes a length or bounds too small.
#pragma once

#include "layout/compiler.h"
#include "layout/error_bounds.h"

#include <cmath>
#include <limits>

namespace cab {

// The least float that is not below `value`.
inline float rounded_up(double value) {
  const auto rounded = static_cast<float>(value);
  return static_cast<double>(rounded) < value ? std::nextafter(rounded, std::numeric_limits<float>::infinity())
                                              : rounded;
}

// Floats just outside of bounds in double: a lower bound moves down, an upper bound up (docs/proof.md, step 4.5).
// Infinity stays what it is.
CAB_INLINE double outwards(double value) {
  constexpr double kMost = std::numeric_limits<double>::max();
  const double size = std::fabs(value);
  return kOutwards * (size < kMost ? size : kMost);
}
CAB_INLINE float float_below(double value) { return static_cast<float>(value - outwards(value)); }
CAB_INLINE float float_above(double value) { return static_cast<float>(value + outwards(value)); }

}  // namespace cab
