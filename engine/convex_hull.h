// Convex hulls of the caller's vertices, by qhull, for exact shapes.
#pragma once

#include <cab/span.h>

#include <vector>

namespace cab {

// Vertices of a hull (x y z each, only those on it) and its triangles (3, i, j, k each, as FCL reads them).
struct ConvexHull {
  std::vector<double> vertices;
  std::vector<int> faces;
  int face_count = 0;
};

// The hull of x y z vertices; face_count 0 when they have no volume.
ConvexHull convex_hull(Span<const float> vertices);

}  // namespace cab
