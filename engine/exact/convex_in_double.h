// Exact::kConvex in double: the second pass, for pairs that the kernels leave undecided.
#pragma once

#include "engine/exact/convex_pair.h"

namespace cab {

// The answer for two shapes, in bit 0: whether they are more than a margin apart.
kernel::ConvexAnswer answer_pair_in_double(const ConvexPair& pair, double margin);

// The answer for the two shapes of one lane, in bit 0.
kernel::ConvexAnswer answer_in_double(const kernel::ConvexBlock& block, std::uint32_t lane);

// Whether the two shapes of one lane touch. A pair that stays undecided touches.
inline bool touch_in_double(const kernel::ConvexBlock& block, std::uint32_t lane) {
  return answer_in_double(block, lane).apart == 0;
}

}  // namespace cab
