// The number type of the judges of poses and shapes, and poses in it.
#pragma once

#include "perf/judge/oracle/vec3.h"

namespace cab::oracle {

using Real = long double;
using Point = Vec3<Real>;

// A rotation's columns and a translation.
struct ExactPose {
  Real column[3][3];
  Point at;
  Real scale = 1;
};

inline Point rotated(const Real (&column)[3][3], const Point& p) {
  return p[0] * to_vec3(column[0]) + p[1] * to_vec3(column[1]) + p[2] * to_vec3(column[2]);
}

// Columns of the rotation of a quaternion of any length.
template <class T>
void quaternion_matrix(const T (&q)[4], T (&column)[3][3]) {
  const T s = 2 / (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  const T x = q[0], y = q[1], z = q[2], w = q[3];
  const T m[3][3] = {{1 - s * (y * y + z * z), s * (x * y + w * z), s * (x * z - w * y)},
                     {s * (x * y - w * z), 1 - s * (x * x + z * z), s * (y * z + w * x)},
                     {s * (x * z + w * y), s * (y * z - w * x), 1 - s * (x * x + y * y)}};
  for (int k = 0; k < 3; ++k)
    for (int c = 0; c < 3; ++c) column[k][c] = m[k][c];
}

}  // namespace cab::oracle
