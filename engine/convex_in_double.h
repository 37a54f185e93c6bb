// Exact::kConvex in double: the second pass of step 5, for pairs that the kernels leave undecided.
#pragma once

#include "engine/convex_pair.h"

namespace cab {

// Whether the two shapes of one lane touch. A pair that stays undecided touches.
bool touch_in_double(const kernel::ConvexBlock& block, std::uint32_t lane);

}  // namespace cab
