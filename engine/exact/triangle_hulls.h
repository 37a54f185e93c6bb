// Triangles of skinned leaves as convex shapes, for the kernels of convex pairs.
#pragma once

#include "engine/exact/exact.h"
#include "kernels/surface/skin_leaf.h"
#include "layout/convex_shape.h"

namespace cab {

// A triangle as the hull of three vertices on a link that is where its instance is.
struct TriangleHull {
  ConvexShape shape;
  ConvexPart part;
  float corners[9];
  alignas(64) float vertices[3 * kLanes];  // ConvexShape::vertices
};

// Triangles that wait in queues, by the kind of the shape on the other side. A queue has at most fifteen of them when
// another is added, so sixteen places in turn are enough.
struct TriangleHulls {
  Span<TriangleHull> shapes;  // kLanes for each kind, or none if no leaf has triangles
  std::uint32_t next[kConvexKindCount] = {};
};

// Makes the places. Throws std::bad_alloc.
void size_triangle_hulls(Arena& arena, TriangleHulls& out);

// Makes the shape of a triangle of a skinned leaf, which waits for a shape of the given kind.
const ConvexShape& add_triangle(const SurfaceLeaves& surface, const SurfaceLeaf& leaf, const kernel::SkinnedLeaf& skin,
                                std::uint32_t triangle, ConvexKind other, TriangleHulls& out);

// The pose of a link that is where its instance is.
StoredPose pose_of_instance();

}  // namespace cab
