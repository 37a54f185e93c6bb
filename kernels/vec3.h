// A point or direction per lane, and the algebra that kernels need.
#pragma once

#include "kernels/simd.h"

namespace cab::kernel {

template <class V>
struct Vec3 {
  V x, y, z;
};

template <class V>
CAB_INLINE Vec3<V> operator+(Vec3<V> a, Vec3<V> b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class V>
CAB_INLINE Vec3<V> operator-(Vec3<V> a, Vec3<V> b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class V>
CAB_INLINE Vec3<V> operator*(V s, Vec3<V> a) {
  return {s * a.x, s * a.y, s * a.z};
}
template <class V>
CAB_INLINE V dot(Vec3<V> a, Vec3<V> b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class V>
CAB_INLINE Vec3<V> cross(Vec3<V> a, Vec3<V> b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <class V>
CAB_INLINE Vec3<V> choose(Mask<V> m, Vec3<V> a, Vec3<V> b) {
  return {select(m, a.x, b.x), select(m, a.y, b.y), select(m, a.z, b.z)};
}
// Overwrites `to` in the lanes of m. In place, since compilers copy large structs of vectors by slow string moves.
template <class V>
CAB_INLINE void take(Mask<V> m, const V& from, V& to) {
  to = select(m, from, to);
}
template <class V>
CAB_INLINE void take(Mask<V> m, const Vec3<V>& from, Vec3<V>& to) {
  to.x = select(m, from.x, to.x);
  to.y = select(m, from.y, to.y);
  to.z = select(m, from.z, to.z);
}
template <class V>
CAB_INLINE Vec3<V> abs(Vec3<V> a) {
  return {abs(a.x), abs(a.y), abs(a.z)};
}
template <class V>
CAB_INLINE Vec3<V> min(Vec3<V> a, Vec3<V> b) {
  return {min(a.x, b.x), min(a.y, b.y), min(a.z, b.z)};
}
template <class V>
CAB_INLINE Vec3<V> max(Vec3<V> a, Vec3<V> b) {
  return {max(a.x, b.x), max(a.y, b.y), max(a.z, b.z)};
}
template <class V>
CAB_INLINE V max_component(Vec3<V> a) {
  return max(max(a.x, a.y), a.z);
}
template <class V>
CAB_INLINE V sum(Vec3<V> a) {
  return a.x + a.y + a.z;
}
template <class V>
CAB_INLINE Vec3<V> normalized(Vec3<V> a) {
  return divide(V(1.0f), sqrt(dot(a, a))) * a;
}

// Loads and stores the three component arrays of a tile at a lane.
template <class V>
CAB_INLINE Vec3<V> load3(const float (&p)[3][kLanes], std::uint32_t lane) {
  return {Lanes<V>::load(p[0] + lane), Lanes<V>::load(p[1] + lane), Lanes<V>::load(p[2] + lane)};
}
template <class V, class T>
CAB_INLINE void store3(T (&p)[3][kLanes], std::uint32_t lane, Vec3<V> v) {
  Lanes<V>::store(p[0] + lane, v.x);
  Lanes<V>::store(p[1] + lane, v.y);
  Lanes<V>::store(p[2] + lane, v.z);
}

}  // namespace cab::kernel
