// The contact of two ellipsoids: Newton's method for the normal along which the supports of both, taken together, are
// least. It finds depths and distances alike.
#pragma once

#include "kernels/convex/depth_search.h"

namespace cab::kernel {

// The support of the difference of two ellipsoids along a unit vector.
template <class V>
struct EllipsoidSupport {
  using D = DoubleOf<V>;
  D height;            // of the difference along the vector
  Vec3<D> on_a, of_b;  // the points farthest along it, from the centres; that of b against it, with the sign changed
  D length_a, length_b;
};

template <class V>
CAB_INLINE void take_support(Mask<DoubleOf<V>> m, const EllipsoidSupport<V>& from, EllipsoidSupport<V>& to) {
  using D = DoubleOf<V>;
  take<D>(m, from.height, to.height);
  take<D>(m, from.on_a, to.on_a);
  take<D>(m, from.of_b, to.of_b);
  take<D>(m, from.length_a, to.length_a);
  take<D>(m, from.length_b, to.length_b);
}

template <class V>
CAB_INLINE EllipsoidSupport<V> ellipsoid_support(const ContactLanes<V>& pair, const Vec3<DoubleOf<V>>& n) {
  using D = DoubleOf<V>;
  const Vec3<D>&a = pair.size_a, &b = pair.size_b;
  const Vec3<D> in_a = {a.x * n.x, a.y * n.y, a.z * n.z};
  const Vec3<D> in_b = {b.x * dot(pair.column[0], n), b.y * dot(pair.column[1], n), b.z * dot(pair.column[2], n)};
  EllipsoidSupport<V> out;
  out.length_a = sqrt(dot(in_a, in_a));
  out.length_b = sqrt(dot(in_b, in_b));
  const D by_a = divide(D(1.0), out.length_a), by_b = divide(D(1.0), out.length_b);
  out.on_a = {by_a * (a.x * in_a.x), by_a * (a.y * in_a.y), by_a * (a.z * in_a.z)};
  out.of_b = rotate(pair.column, Vec3<D>{by_b * (b.x * in_b.x), by_b * (b.y * in_b.y), by_b * (b.z * in_b.z)});
  out.height = (out.length_a + out.length_b) - dot(n, pair.t);
  return out;
}

// From the least of the directions between the centres and along the axes of both. A step that does not lessen the
// height is halved. Writes to `stuck` the lanes in which that ended before the height was least.
template <class V>
CAB_INLINE Touching<DoubleOf<V>> ellipsoid_contact(const ContactLanes<V>& pair, Mask<DoubleOf<V>>& stuck) {
  using D = DoubleOf<V>;
  constexpr std::uint32_t kDirections = 7, kMostSteps = 24;
  const D zero(0.0), one(1.0), half(0.5);
  Vec3<D> n = direction_of(pair.t);
  EllipsoidSupport<V> at = ellipsoid_support(pair, n);
  for (std::uint32_t i = 1; i < kDirections; ++i) {
    Vec3<D> along = start_direction(pair, i);
    take<D>(dot(along, pair.t) < zero, minus(along), along);
    const EllipsoidSupport<V> there = ellipsoid_support(pair, along);
    const Mask<D> less = there.height < at.height;
    take<D>(less, along, n);
    take_support<V>(less, there, at);
  }
  const D enough = D(kDepthProgress) * (pair.reach + sqrt(dot(pair.t, pair.t)));
  Vec3<D> to = n;
  Mask<D> running = zero <= zero;
  stuck = running;
  D damping = one;
  Vec3<D> step = {zero, zero, zero};
  for (std::uint32_t i = 0; i < kMostSteps && bits(running); ++i) {
    // A basis of the tangent plane (Duff et al. 2017).
    const D sign = with_sign(one, n.z), by = divide(zero - one, sign + n.z), skew = n.x * n.y * by;
    const Vec3<D> u = {one + sign * (n.x * n.x * by), sign * skew, zero - sign * n.x};
    const Vec3<D> w = {skew, sign + n.y * n.y * by, zero - n.y};
    const Vec3<D> gradient = (at.on_a + at.of_b) - pair.t;
    const D g_u = dot(gradient, u), g_w = dot(gradient, w);
    const Mask<D> uphill = g_u * g_u + g_w * g_w > enough * enough;
    stuck = both(stuck, uphill);
    running = both(running, uphill);
    // Second derivatives of both heights, of each |A n| by A^2 and A^2 n.
    const D by_a = divide(one, at.length_a), by_b = divide(one, at.length_b);
    const auto scaled = [](const Vec3<D>& s, const Vec3<D>& v) { return Vec3<D>{s.x * v.x, s.y * v.y, s.z * v.z}; };
    const auto in_b = [&](const Vec3<D>& v) {
      return scaled(pair.size_b, {dot(pair.column[0], v), dot(pair.column[1], v), dot(pair.column[2], v)});
    };
    const Vec3<D> u_a = scaled(pair.size_a, u), w_a = scaled(pair.size_a, w), u_b = in_b(u), w_b = in_b(w);
    const D a_u = dot(u, at.on_a), a_w = dot(w, at.on_a), b_u = dot(u, at.of_b), b_w = dot(w, at.of_b);
    const D h_uu = by_a * (dot(u_a, u_a) - a_u * a_u) + by_b * (dot(u_b, u_b) - b_u * b_u) - at.height;
    const D h_ww = by_a * (dot(w_a, w_a) - a_w * a_w) + by_b * (dot(w_b, w_b) - b_w * b_w) - at.height;
    const D h_uw = by_a * (dot(u_a, w_a) - a_u * a_w) + by_b * (dot(u_b, w_b) - b_u * b_w);
    // Made positive definite: its lower eigenvalue is raised to a share of the greater one's size.
    const D mean = half * (h_uu + h_ww), apart = half * (h_uu - h_ww);
    const D spread = sqrt(apart * apart + h_uw * h_uw);
    const D raise = max(D(kLeastCurvature) * (abs(mean) + spread) - (mean - spread), zero);
    const D m_uu = h_uu + raise, m_ww = h_ww + raise;
    const D by_det = divide(one, m_uu * m_ww - h_uw * h_uw);
    const D s_u = by_det * (h_uw * g_w - m_ww * g_u), s_w = by_det * (h_uw * g_u - m_uu * g_w);
    const D norm = sqrt(s_u * s_u + s_w * s_w), shorter = divide(one, max(norm, one));
    step = (shorter * s_u) * u + (shorter * s_w) * w;
    to = direction_of(n + damping * step);
    const EllipsoidSupport<V> there = ellipsoid_support(pair, to);
    const Mask<D> less = both(running, there.height < at.height);
    take<D>(less, to, n);
    take_support<V>(less, there, at);
    damping = select(less, one, half * damping);
    running = both(running, damping > D(kLeastDamping));
  }
  return {n, at.on_a, pair.t - at.of_b};
}

}  // namespace cab::kernel
