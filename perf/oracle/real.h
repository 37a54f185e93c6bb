// The number type of the judges of poses and shapes, and poses in it.
#pragma once

#include "perf/oracle/vec3.h"

namespace cab::oracle {

using Real = long double;
using Point = Vec3<Real>;

// A rotation's columns and a translation.
struct ExactPose {
  Real column[3][3];
  Point at;
};

inline Point rotated(const Real (&column)[3][3], const Point& p) {
  return p[0] * to_vec3(column[0]) + p[1] * to_vec3(column[1]) + p[2] * to_vec3(column[2]);
}

}  // namespace cab::oracle
