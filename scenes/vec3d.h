// Vectors and quaternions in double, for scenes only.
#pragma once

#include <array>
#include <cmath>

namespace cab::scenes {

using Vec3 = std::array<double, 3>;
using Quat = std::array<double, 4>;  // x y z w

inline Vec3 operator+(const Vec3& a, const Vec3& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
inline Vec3 operator-(const Vec3& a, const Vec3& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
inline Vec3 operator*(double s, const Vec3& a) { return {s * a[0], s * a[1], s * a[2]}; }
inline double dot(const Vec3& a, const Vec3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
inline Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline double length(const Vec3& a) { return std::sqrt(dot(a, a)); }

// The product a b: the rotation a after the rotation b.
inline Quat multiply(const Quat& a, const Quat& b) {
  return {a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1], a[3] * b[1] - a[0] * b[2] + a[1] * b[3] + a[2] * b[0],
          a[3] * b[2] + a[0] * b[1] - a[1] * b[0] + a[2] * b[3], a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2]};
}
inline Quat conjugate(const Quat& q) { return {-q[0], -q[1], -q[2], q[3]}; }

// q divided by its length, or the identity if the length is 0.
inline Quat normalized(const Quat& q) {
  const double n = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (!(n > 0)) return {0, 0, 0, 1};
  return {q[0] / n, q[1] / n, q[2] / n, q[3] / n};
}

// v rotated by the unit quaternion q.
inline Vec3 rotate(const Quat& q, const Vec3& v) {
  const Vec3 u = {q[0], q[1], q[2]};
  const Vec3 t = 2.0 * cross(u, v);
  return v + q[3] * t + cross(u, t);
}

}  // namespace cab::scenes
