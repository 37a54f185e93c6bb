// Rounding from double to float that never makes a length too small.
#pragma once

#include <cmath>
#include <limits>

namespace cab {

// The least float that is not below `value`.
inline float rounded_up(double value) {
  const auto rounded = static_cast<float>(value);
  return static_cast<double>(rounded) < value ? std::nextafter(rounded, std::numeric_limits<float>::infinity())
                                              : rounded;
}

}  // namespace cab
