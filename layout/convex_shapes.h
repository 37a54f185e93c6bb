// The convex shapes of an articulation: the parts of every leaf as the exact kernels read them.
#pragma once

#include "layout/arena.h"
#include "layout/articulation.h"
#include "layout/convex_shape.h"
#include "layout/round_leaf.h"

namespace cab {

// The shapes of all leaves of an articulation. Shapes of leaf l: shapes[leaf_begin[l]] to shapes[leaf_begin[l + 1] -
// 1]. A leaf without parts has one shape, its box.
struct ConvexShapes {
  Span<const ConvexShape> shapes;
  Span<const std::uint32_t> leaf_begin;  // leaf_count + 1 indices
  RoundBody round;                       // by make_round_body: empty unless every leaf is one ball or one capsule
};

// The shape of a box, with axes that are orthonormal to rounding in double.
ConvexShape shape_of_box(const Box& box);

// Makes the shapes of an articulation in the arena, without `round`. Throws std::bad_alloc.
ConvexShapes make_convex_shapes(const Articulation& articulation, Arena& arena);

}  // namespace cab
