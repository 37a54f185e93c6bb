// The last word on two triangles, in double: for pairs that test_triangles leaves undecided in float.
#pragma once

#include "kernels/surface/test_triangles.h"

namespace cab::kernel {

// What is left of v across an edge. Twice, since v may be almost along the edge.
CAB_INLINE Vec3<double> square_to(Vec3<double> v, const Vec3<double>& edge) {
  const double length_sq = dot(edge, edge);
  for (int i = 0; i < 2 && length_sq > 0; ++i) v = v - divide(dot(v, edge), length_sq) * edge;
  return v;
}

// The normal made square to the longest edge once more. That of a sliver is off along it by rounding over the sliver's
// width, which can hide a gap.
CAB_INLINE Vec3<double> normal_of(const TriangleShape<double>& triangle) {
  int longest = 0;
  for (int k = 1; k < 3; ++k)
    if (triangle.size[k] > triangle.size[longest]) longest = k;
  return square_to(triangle.normal, triangle.edge[longest]);
}

// Whether a direction in which two triangles may be nearest to each other parts them: from a corner to a corner, or
// from an edge to a corner. The others are normals and products of edges, which test_triangles has tried; those of
// slivers and of edges that are almost parallel are tried again. A product of such edges is off along them by rounding
// over their angle, which can hide a gap. It is made square to one of them again: along the other it is then off by
// that times the angle.
CAB_INLINE bool apart_by_corners(const TriangleLanes<double>& a, const TriangleLanes<double>& b,
                                 const TrianglePair<double>& pair, const TriangleSlack<double>& slack) {
  const auto parts = [&](const Vec3<double>& v) {
    return dot(v, v) > kLeastDirectionSqDouble && beyond_along(v, pair, slack) > 0;
  };
  if (parts(normal_of(pair.a)) || parts(normal_of(pair.b))) return true;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      const Vec3<double> between = b.corner[j] - a.corner[i];
      // Corner i begins edge i of a, and corner j edge j of b.
      const Vec3<double> across = square_to(cross(pair.a.edge[i], pair.b.edge[j]), pair.a.edge[i]);
      if (parts(between) || parts(square_to(between, pair.a.edge[i])) || parts(square_to(between, pair.b.edge[j])) ||
          parts(across))
        return true;
    }
  return false;
}

// Whether two triangles have points within the margin of each other, to the rounding of doubles. What stays undecided
// touches, so no pair that touches is lost. error, margin: as test_triangles takes them.
CAB_INLINE bool touch_in_double(const TriangleLanes<double>& a, const TriangleLanes<double>& b, double error,
                                double margin) {
  const ConvexAnswer answer = test_triangles(a, b, error, margin, 1);
  if (answer.apart || answer.touching) return answer.touching != 0;
  const TrianglePair<double> pair = pair_of(a, b);
  return !apart_by_corners(a, b, pair, slack_of(pair, error, margin));
}

}  // namespace cab::kernel
