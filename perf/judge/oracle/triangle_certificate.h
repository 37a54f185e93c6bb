// A quick proof in double that two triangles are apart: a plane between them, with a gap that rounding cannot make.
#pragma once

#include "perf/judge/oracle/triangle_judge.h"

namespace cab::oracle {

// What rounding may add to the gap that is found along a direction: so much of the largest coordinate and of the
// direction's absolute sum. With u = 2^-53, corners are rounded by u, a projection by 3 u, and there are two of each;
// the difference of the two, at most twice as large, by u: 10 u in all, and 16 u here.
inline constexpr double kTriangleCertificateRounding = 0x1p-49;

// Whether a plane across this direction, of any length, has the triangles on its two sides, at least `slack` apart.
inline bool parted_along(const Vec3<double>& direction, const Triangle<double>& a, const Triangle<double>& b,
                         double slack) {
  const double needed = norm_1(direction) * slack;
  double lo[2], hi[2];
  for (std::size_t s = 0; s < 2; ++s) {
    const auto& corner = (s == 0 ? a : b).corner;
    const double first = dot(direction, corner[0]), second = dot(direction, corner[1]),
                 third = dot(direction, corner[2]);
    lo[s] = std::min(std::min(first, second), third);
    hi[s] = std::max(std::max(first, second), third);
  }
  return std::max(lo[1] - hi[0], lo[0] - hi[1]) > needed;
}

// Whether the triangles, given as doubles next to their true corners, are certainly farther apart than `least`.
// reach: no coordinate is larger. False says nothing.
inline bool certainly_apart(const Triangle<double>& a, const Triangle<double>& b, double reach, double least) {
  const double slack = kTriangleCertificateRounding * reach + least;
  Vec3<double> edge[2][3], normal[2];
  for (std::size_t s = 0; s < 2; ++s) {
    const auto& corner = (s == 0 ? a : b).corner;
    for (std::size_t k = 0; k < 3; ++k) edge[s][k] = corner[(k + 1) % 3] - corner[k];
    normal[s] = cross(edge[s][0], edge[s][1]);
    if (parted_along(normal[s], a, b, slack)) return true;
  }
  for (const Vec3<double>& of_a : edge[0])
    for (const Vec3<double>& of_b : edge[1])
      if (parted_along(cross(of_a, of_b), a, b, slack)) return true;
  for (std::size_t s = 0; s < 2; ++s)
    for (const Vec3<double>& along : edge[s])
      if (parted_along(cross(normal[s], along), a, b, slack)) return true;
  return false;
}

}  // namespace cab::oracle
