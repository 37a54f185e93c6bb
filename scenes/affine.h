// Affine maps in double, for scenes only.
#pragma once

#include "scenes/vec3d.h"

#include <array>

namespace cab::scenes {

// The map of x to m x + t. The columns are those of m, the translation is t.
struct Affine {
  std::array<Vec3, 3> columns = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  Vec3 translation = {0, 0, 0};
};

// m v, for directions, and m p + t, for points.
inline Vec3 turn(const Affine& a, const Vec3& v) {
  return v[0] * a.columns[0] + v[1] * a.columns[1] + v[2] * a.columns[2];
}
inline Vec3 transform(const Affine& a, const Vec3& p) { return a.translation + turn(a, p); }

inline Affine multiply(const Affine& a, const Affine& b) {
  Affine product;
  for (std::size_t k = 0; k < 3; ++k) product.columns[k] = turn(a, b.columns[k]);
  product.translation = transform(a, b.translation);
  return product;
}

// The rotation of a matrix that may scale, shear or mirror. Its axes become orthonormal in order (Gram-Schmidt).
inline Quat rotation_of(const Affine& a) {
  Vec3 x = a.columns[0];
  Vec3 y = a.columns[1];
  const double x_length = length(x);
  if (!(x_length > 0)) return {0, 0, 0, 1};
  x = (1 / x_length) * x;
  y = y - dot(x, y) * x;
  const double y_length = length(y);
  if (!(y_length > 0)) return {0, 0, 0, 1};
  y = (1 / y_length) * y;
  const Vec3 z = cross(x, y);
  // The largest of the four components first (Shepperd 1978).
  const double trace = x[0] + y[1] + z[2];
  if (trace >= x[0] && trace >= y[1] && trace >= z[2])
    return normalized({y[2] - z[1], z[0] - x[2], x[1] - y[0], 1 + trace});
  if (x[0] >= y[1] && x[0] >= z[2]) return normalized({1 + x[0] - y[1] - z[2], y[0] + x[1], z[0] + x[2], y[2] - z[1]});
  if (y[1] >= z[2]) return normalized({y[0] + x[1], 1 + y[1] - x[0] - z[2], z[1] + y[2], z[0] - x[2]});
  return normalized({z[0] + x[2], z[1] + y[2], 1 + z[2] - x[0] - y[1], x[1] - y[0]});
}

}  // namespace cab::scenes
