// The widest floating-point type of the platform: a 113-bit significand on x86-64 and on aarch64.
#pragma once

#include <cfloat>

namespace cab::oracle {

#if defined(__SIZEOF_FLOAT128__)
__extension__ typedef __float128 Quad;
#else
using Quad = long double;
static_assert(LDBL_MANT_DIG >= 113, "the oracles need a quadruple-precision type");
#endif

}  // namespace cab::oracle
