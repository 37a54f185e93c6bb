// The least that any refit could do: the smallest box about boxes along any axes, by a search over rotations.
#pragma once

#include "perf/oracle/oracle_box.h"
#include "perf/oracle/random.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace cab::oracle {

// The surface of a box with half extents h.
template <class T>
T surface_of(const T (&h)[3]) {
  return 8 * (h[0] * h[1] + h[1] * h[2] + h[2] * h[0]);
}

// The surface of the smallest box along three unit axes at right angles that contains all boxes.
inline double surface_along(const std::vector<OracleBox<double>>& boxes, const double (&axes)[3][3]) {
  double half[3];
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3<double> direction = to_vec3(axes[k]);
    double lo = HUGE_VAL, hi = -HUGE_VAL;
    for (const OracleBox<double>& box : boxes) {
      const double middle = dot(center_of(box), direction);
      double reach = 0;
      for (std::size_t i = 0; i < 3; ++i) reach += box.half[i] * std::fabs(dot(axis_of(box, i), direction));
      lo = std::min(lo, middle - reach);
      hi = std::max(hi, middle + reach);
    }
    half[k] = (hi - lo) / 2;
  }
  return surface_of(half);
}

// The least of that over rotations: the best of `tries` random ones and of the boxes' own axes, then turned by ever
// smaller random angles while that gains. Never below the true least.
inline double least_surface(const std::vector<OracleBox<double>>& boxes, Random& random, int tries = 300) {
  double best[3][3], turned[3][3], turn[3][3];
  double least = HUGE_VAL;
  const auto consider = [&](const double(&axes)[3][3]) {
    const double surface = surface_along(boxes, axes);
    if (!(surface < least)) return false;
    least = surface;
    std::copy(&axes[0][0], &axes[0][0] + 9, &best[0][0]);
    return true;
  };
  for (const OracleBox<double>& box : boxes) consider(box.axis);
  for (int i = 0; i < tries; ++i) {
    random.rotation(turn);
    consider(turn);
  }
  for (double angle = 0.5; angle > 1e-4; angle *= 0.8) {
    for (int i = 0; i < 20; ++i) {
      const Vec3<double> about = angle * random.unit_vector();  // Rodrigues' turn by half-angle tangents
      const double sq = dot(about, about);
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec3<double> v = to_vec3(best[k]);
        const Vec3<double> w = v + (2 / (1 + sq)) * (cross(about, v) + cross(about, cross(about, v)));
        for (std::size_t c = 0; c < 3; ++c) turned[k][c] = w[c];
      }
      consider(turned);
    }
  }
  return least;
}

}  // namespace cab::oracle
