// The paper's OBB: axes along the principal directions of box corners, by a Jacobi eigen-solver of fixed length.
#pragma once

#include "kernels/box.h"

namespace cab::kernel {

// A sweep is three rotations. On a 3x3 matrix the method converges quadratically: four sweeps reach float's rounding
// from any start (tests/kernels/covariance_test.cpp).
inline constexpr int kJacobiSweeps = 4;

// A symmetric 3x3 matrix.
template <class V>
struct Symmetric {
  V xx, yy, zz, xy, xz, yz;
};

template <class V>
CAB_INLINE Symmetric<V> operator+(const Symmetric<V>& a, const Symmetric<V>& b) {
  return {a.xx + b.xx, a.yy + b.yy, a.zz + b.zz, a.xy + b.xy, a.xz + b.xz, a.yz + b.yz};
}
template <class V>
CAB_INLINE Symmetric<V> scaled(V s, const Symmetric<V>& a) {
  return {s * a.xx, s * a.yy, s * a.zz, s * a.xy, s * a.xz, s * a.yz};
}

// The outer product of a vector with itself.
template <class V>
CAB_INLINE Symmetric<V> outer(Vec3<V> a) {
  return {a.x * a.x, a.y * a.y, a.z * a.z, a.x * a.y, a.x * a.z, a.y * a.z};
}

// The covariance of the eight corners of a box: the sum of e_k^2 A_k A_k^T, where e_k are the half extents and A_k the
// axes.
template <class V>
CAB_INLINE Symmetric<V> corner_covariance(const BoxLanes<V>& box) {
  return outer(box.half.x * box.axis[0]) + outer(box.half.y * box.axis[1]) + outer(box.half.z * box.axis[2]);
}

// The covariance of the sixteen corners of two boxes.
template <class V>
CAB_INLINE Symmetric<V> corner_covariance(const BoxLanes<V>& first, const BoxLanes<V>& second) {
  const V half(0.5f), quarter(0.25f);
  return scaled(half, corner_covariance(first)) + scaled(half, corner_covariance(second)) +
         scaled(quarter, outer(second.center - first.center));
}

// One Jacobi rotation, which clears the off-diagonal entry of p and q; r is the third index. If the entry is zero,
// nothing is rotated.
template <class V>
CAB_INLINE void rotate_pair(V& pp, V& qq, V& pq, V& pr, V& qr, Vec3<V>& axis_p, Vec3<V>& axis_q) {
  const V zero(0.0f), one(1.0f), two(2.0f);
  const V difference_of_diagonal = qq - pp;
  const V twice = two * pq;
  const V root = sqrt(difference_of_diagonal * difference_of_diagonal + twice * twice);
  const V denominator = abs(difference_of_diagonal) + root;
  const V size = select(denominator > zero, divide(twice, denominator), zero);
  const V t = select(difference_of_diagonal < zero, -size, size);
  const V c = divide(one, sqrt(t * t + one));
  const V s = t * c;
  pp = pp - t * pq;
  qq = qq + t * pq;
  pq = zero;
  const V pr_before = pr;
  pr = c * pr_before - s * qr;
  qr = s * pr_before + c * qr;
  const Vec3<V> p_before = axis_p;
  axis_p = c * p_before - s * axis_q;
  axis_q = s * p_before + c * axis_q;
}

// True lanes have no NaN and no infinity in the vector.
template <class V>
CAB_INLINE Mask<V> is_finite(Vec3<V> a) {
  const V largest(3.402823466e38f);
  return both(both(abs(a.x) <= largest, abs(a.y) <= largest), abs(a.z) <= largest);
}

// The eigenvectors, orthonormal to rounding and right-handed, in no particular order. If squares of the matrix's
// entries overflow or underflow float, the axes are those of the world.
template <class V>
CAB_INLINE void eigen_axes(Symmetric<V> m, Vec3<V> (&axes)[3]) {
  const V zero(0.0f), one(1.0f);
  const Vec3<V> world[3] = {{one, zero, zero}, {zero, one, zero}, {zero, zero, one}};
  Vec3<V> x = world[0], y = world[1], z = world[2];
  for (int sweep = 0; sweep < kJacobiSweeps; ++sweep) {
    rotate_pair(m.xx, m.yy, m.xy, m.xz, m.yz, x, y);
    rotate_pair(m.xx, m.zz, m.xz, m.xy, m.yz, x, z);
    rotate_pair(m.yy, m.zz, m.yz, m.xy, m.xz, y, z);
  }
  x = normalized(x);
  y = normalized(y - dot(y, x) * x);
  const Mask<V> sound = both(is_finite(x), is_finite(y));
  axes[0] = choose<V>(sound, x, world[0]);
  axes[1] = choose<V>(sound, y, world[1]);
  axes[2] = cross(axes[0], axes[1]);
}

}  // namespace cab::kernel
