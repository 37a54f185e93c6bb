// Exact::kConvex in double: the second pass of step 5, for pairs that the kernels leave undecided, and the contacts of
// step 6.
#pragma once

#include "engine/convex_pair.h"

namespace cab {

// Whether the two shapes of one lane touch. A pair that stays undecided touches.
bool touch_in_double(const kernel::ConvexBlock& block, std::uint32_t lane);

// The contact of two shapes: the least way to part them where they overlap, else minus their distance. shift: the
// origin of b's instance less that of a's instance. The depth always suffices to part the shapes. It is the least one
// for round shapes and boxes, and with a half space; for others it is that of the best of three local searches. A
// distance is never too large. Two half spaces have no contact: all numbers are 0.
Contact contact_in_double(const PlacedShape& a, const PlacedShape& b, const double (&shift)[3]);

}  // namespace cab
