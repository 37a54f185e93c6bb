// A body all of whose leaves are balls or capsules, as the kernel for sequences of such bodies reads it.
#pragma once

#include "layout/arena.h"
#include "layout/articulation.h"
#include "layout/convex_shapes.h"
#include "layout/round_leaf.h"

namespace cab {

// Makes the round leaves of an articulation in the arena. There are none if a leaf is anything but one ball or capsule,
// or if a number is beyond kMostRoundLength. Throws std::bad_alloc.
RoundBody make_round_body(const Articulation& articulation, const ConvexShapes& shapes, Arena& arena);

}  // namespace cab
