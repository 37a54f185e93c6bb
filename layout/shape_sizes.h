// How many sizes the kinds of shapes have.
#pragma once

#include <cab/types.h>

namespace cab {

// How many of ConvexPart::size a kind uses, or -1 if there is no such kind.
inline int size_count(ShapeKind kind) {
  switch (kind) {
    case ShapeKind::kBox:
    case ShapeKind::kEllipsoid: return 3;
    case ShapeKind::kCapsule:
    case ShapeKind::kCylinder: return 2;
    case ShapeKind::kSphere: return 1;
    case ShapeKind::kConvexHull:
    case ShapeKind::kHalfSpace: return 0;
  }
  return -1;
}

}  // namespace cab
