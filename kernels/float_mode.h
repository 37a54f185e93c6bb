// The floating-point control word. The library computes with rounding to nearest, denormals kept and exceptions masked,
// whatever mode the caller runs with, so that results have the same bits.
#pragma once

#include "layout/compiler.h"

namespace cab::kernel {

// Sets the library's mode for a scope, and restores the caller's mode afterwards. On x86 that includes the sticky
// exception flags.
class FloatMode {
 public:
  FloatMode() noexcept : saved_(read_float_control()) { write_float_control(kPlainFloatControl); }
  ~FloatMode() { write_float_control(saved_); }
  FloatMode(const FloatMode&) = delete;
  FloatMode& operator=(const FloatMode&) = delete;

 private:
  FloatControl saved_;
};

}  // namespace cab::kernel
