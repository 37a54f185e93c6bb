// A convex shape as the exact kernels read it.
#pragma once

#include "layout/polytope.h"

#include <cab/types.h>

namespace cab {

// The kinds of shapes that the exact kernels tell apart.
enum class ConvexKind : std::uint8_t {
  kRound,      // all points within a radius of a segment along z, or of a point: size = radius, unused, half length
  kEllipsoid,  // size: radii along x, y, z
  kBox,        // size: half extents along x, y, z
  kHull,       // the convex hull of `vertices`; size: half extents of the box about them
  kCylinder,   // size: radius, unused, half length along z
  kHalfSpace,  // all points with z <= 0; size unused
};
inline constexpr std::uint32_t kConvexKindCount = static_cast<std::uint32_t>(ConvexKind::kHalfSpace) + 1;

// One convex shape. The first 64 bytes are one row of a transpose. All lengths are in the caller's unit.
// Pointers are into the articulation's arena.
struct alignas(64) ConvexShape {
  float position[3];   // of the shape's centre, in the link's frame
  float column[3][3];  // the shape's axes in the link's frame
  float size[3];       // see ConvexKind
  float reach;         // no point of the shape is farther from its centre; 0 for a half space

  // Vertices of a hull relative to its centre, divided by `unit`, in chunks of sixteen x, sixteen y, sixteen z. They
  // ascend by x, then y, then z. The last chunk repeats the last vertex.
  const float* vertices;
  std::uint32_t vertex_count;
  float unit;  // a power of two: the largest number in `vertices` is between 1/2 and 1
  ConvexKind kind;

  // For double: the shape's axes in the link's frame, and the part that a hull was made from.
  double axis[3][3];
  const ConvexPart* part;

  const Polytope* polytope;  // of a box or a hull of few vertices, with which its size or `unit` is multiplied; or null
};
static_assert(sizeof(ConvexShape) == 192);

}  // namespace cab
