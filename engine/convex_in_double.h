// Step 5 of a frame with Exact::kConvex: the second pass, for pairs that the kernels leave undecided.
#pragma once

#include "kernels/convex/convex_block.h"

namespace cab {

// Whether the two shapes of one lane touch: tests them in double, from the caller's poses and shapes as they were given.
// A pair that stays undecided touches.
bool touch_in_double(const kernel::ConvexBlock& block, std::uint32_t lane);

}  // namespace cab
