// Three-component vectors over any scalar type, for the oracles only.
#pragma once

#include <cmath>
#include <cstddef>

namespace cab::oracle {

// A point or a direction. The code that makes it says its frame and unit.
template <class T>
struct Vec3 {
  T v[3];

  constexpr T& operator[](std::size_t i) { return v[i]; }
  constexpr const T& operator[](std::size_t i) const { return v[i]; }
};

// A copy of three consecutive components.
template <class T>
constexpr Vec3<T> to_vec3(const T (&from)[3]) {
  return {{from[0], from[1], from[2]}};
}

// Writes a vector into three consecutive components.
template <class T>
constexpr void store(const Vec3<T>& from, T (&to)[3]) {
  for (std::size_t i = 0; i < 3; ++i) to[i] = from[i];
}

// Componentwise conversion, rounding to nearest where To is narrower than From.
template <class To, class From>
constexpr Vec3<To> convert(const Vec3<From>& a) {
  return {{static_cast<To>(a[0]), static_cast<To>(a[1]), static_cast<To>(a[2])}};
}

template <class T>
constexpr Vec3<T> operator+(const Vec3<T>& a, const Vec3<T>& b) {
  return {{a[0] + b[0], a[1] + b[1], a[2] + b[2]}};
}

template <class T>
constexpr Vec3<T> operator-(const Vec3<T>& a, const Vec3<T>& b) {
  return {{a[0] - b[0], a[1] - b[1], a[2] - b[2]}};
}

template <class T>
constexpr Vec3<T> operator*(const T& s, const Vec3<T>& a) {
  return {{s * a[0], s * a[1], s * a[2]}};
}

template <class T>
constexpr T dot(const Vec3<T>& a, const Vec3<T>& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

template <class T>
constexpr Vec3<T> cross(const Vec3<T>& a, const Vec3<T>& b) {
  return {{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]}};
}

// |s|, also for the types that std::abs does not know.
template <class T>
constexpr T magnitude(const T& s) {
  return s < T(0) ? -s : s;
}

// The larger of two ordered values.
template <class T>
constexpr T larger(const T& a, const T& b) {
  return a < b ? b : a;
}

// Sum of the absolute components.
template <class T>
constexpr T norm_1(const Vec3<T>& a) {
  return magnitude(a[0]) + magnitude(a[1]) + magnitude(a[2]);
}

// Largest absolute component.
template <class T>
constexpr T norm_max(const Vec3<T>& a) {
  return larger(larger(magnitude(a[0]), magnitude(a[1])), magnitude(a[2]));
}

// Euclidean length.
inline double norm(const Vec3<double>& a) { return std::sqrt(dot(a, a)); }

// The unit vector along a non-zero vector.
inline Vec3<double> normalized(const Vec3<double>& a) { return (1.0 / norm(a)) * a; }

}  // namespace cab::oracle
