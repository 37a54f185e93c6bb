// GJK for contacts: the closest point of the difference of two shapes to the origin, or a tetrahedron of it that
// contains the origin.
#pragma once

#include "kernels/convex/contact_lanes.h"

namespace cab::kernel {

// What GJK ends with in the lanes that it was asked for. is_inside: the tetrahedron of `corner` contains the origin.
// is_apart: a plane across `normal`, which goes from the origin to the closest feature, parts the shapes; the first
// three corners are those of that feature. Other lanes ended too near to the origin.
template <class V>
struct Closest {
  using D = DoubleOf<V>;
  Mask<D> is_inside, is_apart;
  DifferencePoint<D> corner[4];
  Vec3<D> normal;
};

template <class V>
CAB_NOINLINE Closest<V> find_closest(const ContactLanes<V>& pair, Mask<DoubleOf<V>> lanes) {
  using D = DoubleOf<V>;
  constexpr std::uint32_t kMostSteps = 64;
  const D zero(0.0), progress(kContactProgress);
  Vec3<D> v = minus(pair.t);
  v = choose<D>(dot(v, v) > zero, v, {D(1.0), zero, zero});
  std::uint32_t active = bits(lanes);
  const DifferencePoint<D> first = pair.farthest(minus(v), active);
  Simplex<D, DifferencePoint<D>> simplex, next;
  simplex.set(first);
  Closest<V> out;
  out.is_inside = out.is_apart = zero < zero;
  out.corner[3] = first;
  Mask<D> running = both(lanes, simplex.length_sq > pair.slack * pair.slack);
  for (std::uint32_t step = 1; step < kMostSteps; ++step) {
    active = bits(running);
    if (!active) break;
    v = simplex.normal;
    const DifferencePoint<D> point = pair.farthest(minus(v), active);
    const D v_sq = dot(v, v), gap = dot(v, point.at);
    out.is_apart = either(without(out.is_apart, running), both(running, gap > zero));
    running = both(running, v_sq - gap > progress * v_sq);
    const Mask<D> inside = both(running, add_point(point, pair.slack, pair.rounding, simplex, next));
    out.is_inside = either(out.is_inside, inside);
    take<D>(inside, point, out.corner[3]);
    running = both(without(running, inside), next.length_sq < simplex.length_sq);
    for (int i = 0; i < 3; ++i) take<D>(running, next.corner[i], simplex.corner[i]);
    take<D>(running, next.normal, simplex.normal);
    take<D>(running, next.length_sq, simplex.length_sq);
    running = both(running, simplex.length_sq > pair.slack * pair.slack);
  }
  out.normal = simplex.normal;
  out.is_apart = both(out.is_apart, dot(out.normal, out.normal) > pair.slack * pair.slack);
  for (int i = 0; i < 3; ++i) out.corner[i] = simplex.corner[i];
  return out;
}

// The weights of the last two of three corners at the point of their triangle, or of what is left of it, that is
// nearest to `at`.
template <class D>
CAB_INLINE void weights_at(const DifferencePoint<D>* corner, const Vec3<D>& at, D& to_e, D& to_f) {
  const D zero(0.0), one(1.0);
  const Vec3<D> e = corner[1].at - corner[0].at, f = corner[2].at - corner[0].at, to = at - corner[0].at;
  const D ee = dot(e, e), ef = dot(e, f), ff = dot(f, f), te = dot(to, e), tf = dot(to, f);
  const D area = ee * ff - ef * ef;
  const Mask<D> flat = area <= D(kFlatTriangle) * (ee * ff);
  const Mask<D> along_e = ee >= ff;
  const auto ratio = [&](D above, D below) { return select(below > zero, divide(above, below), zero); };
  to_e = select(flat, select(along_e, ratio(te, ee), zero), divide(te * ff - tf * ef, area));
  to_f = select(flat, select(along_e, zero, ratio(tf, ff)), divide(tf * ee - te * ef, area));
  to_e = min(max(to_e, zero), one);
  to_f = min(max(to_f, zero), one - to_e);
}

}  // namespace cab::kernel
