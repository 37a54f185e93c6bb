// Convex hulls of points, with faces, in double.
#pragma once

#include "scenes/vec3d.h"

#include <array>
#include <cstdint>
#include <vector>

namespace cab::scenes {

// A plane: outside of it are the points x with dot(normal, x) > offset. The normal has length 1.
struct Plane {
  Vec3 normal = {0, 0, 0};
  double offset = 0;
};

// A convex polytope with triangles as faces, seen counter-clockwise from outside. It has no faces if its points are all
// in one plane, to rounding.
struct Hull {
  std::vector<Vec3> vertices;
  std::vector<std::array<std::uint32_t, 3>> faces;
  std::vector<Plane> planes;  // one per face
  double volume = 0;
};

// The hull of at most max_vertices of the points (at least 4). It begins with a large tetrahedron and takes the point
// that is farthest outside, until none is farther than 1e-9 of the longest side of their bounding box. So with fewer
// vertices than the full hull has, it is within the full hull and near to it. Coordinates are finite.
Hull convex_hull(const std::vector<Vec3>& points, std::size_t max_vertices);

// A hull with at most max_vertices vertices, rounded to float, that contains all points: convex_hull, enlarged about
// its centre if it leaves points out. Without faces if the points are in one plane.
Hull enclosing_hull(const std::vector<Vec3>& points, std::size_t max_vertices);

// The distance from a point to the nearest point of a triangle.
double distance_to_triangle(const Vec3& point, const std::array<Vec3, 3>& corners);

}  // namespace cab::scenes
