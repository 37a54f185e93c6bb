// Convex hulls of the caller's vertices for the shapes of the exact test, computed by qhull.
#pragma once

#include <cab/span.h>

#include <vector>

namespace cab {

// A convex hull as a mesh of triangles.
struct ConvexHull {
  std::vector<double> vertices;  // x y z per vertex of the hull
  std::vector<int> faces;        // per triangle, as fcl::Convex reads it: 3, then the indices of three vertices
  int face_count = 0;
};

// Returns the hull of `vertices` (x y z each). face_count is 0 if qhull fails, as it does for vertices without volume.
ConvexHull convex_hull(Span<const float> vertices);

}  // namespace cab
