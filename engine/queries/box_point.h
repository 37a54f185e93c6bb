// A point next to a posed leaf box.
#pragma once

#include "engine/exact/convex_pair.h"
#include "layout/box_aos.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace cab {

// A point as a posed box sees it, in double. Along one axis after the other, the point of the box moves to where it is
// nearest.
struct BoxPoint {
  const BoxAos& box;
  Double3 outside;  // the way from the nearest point of the box to the point
  double along[3];  // of the nearest point, along each axis
  double to_face;   // 0 or more if the point is inside: how far it is from the nearest face
  int face;         // along which axis that is

  BoxPoint(const BoxAos& of, const Double3& at) : box(of), outside(at - double3(of.center)), along{}, face(0) {
    to_face = std::numeric_limits<double>::infinity();
    const Double3 from = outside;
    for (int k = 0; k < 3; ++k) {
      const double way = kernel::dot(axis(k), from), half = static_cast<double>(box.half[k]);
      move(k, way);
      if (half - std::fabs(way) >= to_face) continue;
      to_face = half - std::fabs(way);
      face = k;
    }
  }

  Double3 axis(int k) const { return double3(box.axis + 3 * k); }
  bool is_inside() const { return to_face >= 0; }
  bool is_within(double distance) const { return is_inside() || std::sqrt(kernel::dot(outside, outside)) <= distance; }
  Double3 normal_of_face() const { return along[face] < 0 ? -1.0 * axis(face) : axis(face); }

  // Makes up for axes that are a little skew.
  void refine() {
    for (int sweep = 0; sweep < 3; ++sweep)
      for (int k = 0; k < 3; ++k) move(k, along[k] + kernel::dot(axis(k), outside));
  }

 private:
  void move(int k, double to) {
    const double half = static_cast<double>(box.half[k]), next = std::min(std::max(to, -half), half);
    outside = outside - (next - along[k]) * axis(k);
    along[k] = next;
  }
};

}  // namespace cab
