// Exact::kConvex in double: the second pass of step 5, for pairs that the kernels leave undecided, and the contacts of
// step 6.
#pragma once

#include "engine/convex_pair.h"

namespace cab {

// The answer for the two shapes of one lane, in bit 0.
kernel::ConvexAnswer answer_in_double(const kernel::ConvexBlock& block, std::uint32_t lane);

// Whether the two shapes of one lane touch. A pair that stays undecided touches.
inline bool touch_in_double(const kernel::ConvexBlock& block, std::uint32_t lane) {
  return answer_in_double(block, lane).apart == 0;
}

// The contact of two shapes: the least way to part them where they overlap, else minus their distance. shift: the
// origin of b's instance less that of a's instance. The depth always suffices to part the shapes. It is the least one
// for round shapes and boxes; for others it is that of the best of three local searches. A distance is never too large.
Contact contact_in_double(const PlacedShape& a, const PlacedShape& b, const double (&shift)[3]);

}  // namespace cab
