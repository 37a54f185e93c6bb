// The faces and edges of the convex hull of a few points, by trying every plane through three of them.
#pragma once

#include "perf/judge/oracle/real.h"

#include <span>
#include <vector>

namespace cab::oracle {

// An edge, with the outward normals of the two faces that it joins.
struct HullEdge {
  Point along;
  Point normal[2];
};

// What the directions of least depth of a hull are made of. A hull in one plane has two faces. Each of its edges stands
// twice: from one face to the direction in the plane that is normal to the edge, and from there to the other face. A
// hull in one line has four normals and one edge from each to the next, and a single point has one normal.
struct HullFaces {
  std::vector<Point> normals;  // outward, of length 1
  std::vector<HullEdge> edges;
};

// The faces of the hull of at least one point. The time grows with the fourth power of the number of points. A plane
// counts as a face if no point is beyond it by more than 1e-12 of the size: too many faces do no harm to a judge that
// measures along each normal.
HullFaces find_faces(std::span<const Point> points);

}  // namespace cab::oracle
