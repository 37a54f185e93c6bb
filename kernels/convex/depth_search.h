// The depth of two shapes whose difference contains the origin: a local search for the face of the difference that is
// nearest to the origin. A ray from the origin is followed to the face through which it leaves; the ray along that
// face's normal leaves no later, and is followed next.
#pragma once

#include "kernels/convex/closest_points.h"

#include <limits>

namespace cab::kernel {

// A direction along which b can leave a, how far it must go, and the difference's face at its end.
template <class V>
struct Exit {
  using D = DoubleOf<V>;
  Vec3<D> normal;
  D depth;
  DifferencePoint<D> corner[3];
};

// A vector over its length, along x if it has none.
template <class D>
CAB_INLINE Vec3<D> direction_of(const Vec3<D>& v) {
  const D norm_sq = dot(v, v), zero(0.0);
  const D by = divide(D(1.0), sqrt(norm_sq));
  return choose<D>(norm_sq > D(kLeastNormal), by * v, {D(1.0), zero, zero});
}

// Swaps two points in the lanes of m.
template <class D>
CAB_INLINE void swap(Mask<D> m, Vec3<D>& a, Vec3<D>& b) {
  const Vec3<D> before = a;
  take<D>(m, b, a);
  take<D>(m, before, b);
}

// Three corners of the difference, counterclockwise seen from outside: a ray from the origin meets the triangle if it
// is on the positive side of the three planes through the origin and an edge.
template <class D>
struct Portal {
  DifferencePoint<D> p, q, r;

  CAB_INLINE void turn_over(Mask<D> m) {
    swap<D>(m, p.at, q.at);
    swap<D>(m, p.on_a, q.on_a);
  }
};

// Writes the face of a tetrahedron about the origin that a ray meets.
template <class D>
CAB_INLINE void first_portal(const DifferencePoint<D> (&tetrahedron)[4], const Vec3<D>& ray, Portal<D>& out) {
  const D zero(0.0);
  out.p = tetrahedron[1];
  out.q = tetrahedron[2];
  out.r = tetrahedron[3];
  for (int left_out = 1; left_out < 4; ++left_out) {
    const DifferencePoint<D>&p = tetrahedron[(left_out + 1) % 4], &q = tetrahedron[(left_out + 2) % 4],
          &r = tetrahedron[(left_out + 3) % 4];
    const D side = dot(p.at, cross(q.at, r.at));
    const D pq = with_sign(dot(ray, cross(p.at, q.at)), side), qr = with_sign(dot(ray, cross(q.at, r.at)), side),
            rp = with_sign(dot(ray, cross(r.at, p.at)), side);
    const Mask<D> meets = both(pq >= zero, both(qr >= zero, rp >= zero));
    take<D>(meets, p, out.p);
    take<D>(meets, q, out.q);
    take<D>(meets, r, out.r);
  }
  out.turn_over(dot(out.p.at, cross(out.q.at, out.r.at)) < zero);
}

// Writes a tetrahedron of the difference to the lanes of m, in which GJK ended at the origin before it had one: three
// corners about a ray, and one against them.
template <class V>
CAB_INLINE void complete_tetrahedron(const ContactLanes<V>& pair, const Vec3<DoubleOf<V>>& ray, Mask<DoubleOf<V>> m,
                                     DifferencePoint<DoubleOf<V>> (&out)[4]) {
  using D = DoubleOf<V>;
  const D zero(0.0), one(1.0);
  const std::uint32_t active = bits(m);
  const DifferencePoint<D> first = pair.farthest(ray, active);
  Vec3<D> across = cross(first.at, ray);
  const Vec3<D> any = choose<D>(abs(ray.x) < D(0.5), {one, zero, zero}, {zero, one, zero});
  take<D>(dot(across, across) <= D(kFlatTriangle) * (pair.reach * pair.reach), cross(any, ray), across);
  const DifferencePoint<D> second = pair.farthest(across, active);
  Vec3<D> normal = cross(first.at, second.at);
  take<D>(dot(normal, ray) < zero, minus(normal), normal);
  const DifferencePoint<D> third = pair.farthest(normal, active);
  take<D>(m, pair.farthest(minus((first.at + second.at) + third.at), active), out[0]);
  take<D>(m, first, out[1]);
  take<D>(m, second, out[2]);
  take<D>(m, third, out[3]);
}

// Improves `best` in the lanes of `running`, whose difference contains the origin, from its normal on. tetrahedron: of
// the difference.
template <class V>
CAB_INLINE void follow_rays(const ContactLanes<V>& pair, const DifferencePoint<DoubleOf<V>> (&tetrahedron)[4],
                            Mask<DoubleOf<V>> running, Exit<V>& best) {
  using D = DoubleOf<V>;
  constexpr std::uint32_t kMostSteps = 256;
  const D zero(0.0), within = D(kDepthProgress) * pair.reach;
  Vec3<D> ray = best.normal;
  D ray_depth = best.depth;  // of the face before
  Portal<D> portal;
  first_portal(tetrahedron, ray, portal);
  const Vec3<D>&p = portal.p.at, &q = portal.q.at, &r = portal.r.at;
  for (std::uint32_t step = 0; step < kMostSteps; ++step) {
    const std::uint32_t active = bits(running);
    if (!active) return;
    const Vec3<D> pq = cross(p, q), qr = cross(q, r), rp = cross(r, p);
    const D beside_pq = dot(ray, pq), beside_qr = dot(ray, qr), beside_rp = dot(ray, rp);
    const D beside = min(min(beside_pq, beside_qr), beside_rp);
    const Mask<D> outside = beside < zero, off_pq = both(outside, beside_pq <= beside),
                  off_qr = without(both(outside, beside_qr <= beside), off_pq),
                  off_rp = without(without(outside, off_pq), off_qr);
    Vec3<D> along = cross(q - p, r - p);
    take<D>(off_pq, minus(pq), along);
    take<D>(off_qr, minus(qr), along);
    take<D>(off_rp, minus(rp), along);
    along = direction_of(along);
    const DifferencePoint<D> point = pair.farthest(along, active);
    const D depth = dot(along, point.at), gap = depth - dot(along, p), gained = ray_depth - depth;
    const Mask<D> reached = both(without(running, outside), gap <= max(within, D(0.25) * gained));
    const Mask<D> better = both(running, depth < best.depth);
    take<D>(better, along, best.normal);
    take<D>(better, depth, best.depth);
    const Mask<D> at_best = either(better, both(reached, depth <= best.depth + within));
    take<D>(at_best, portal.p, best.corner[0]);
    take<D>(at_best, portal.q, best.corner[1]);
    take<D>(at_best, portal.r, best.corner[2]);
    // At a face: on along the best normal, or done if that was the ray.
    const Mask<D> settled = both(dot(best.normal, ray) >= D(kSettledCosine), depth <= best.depth + within);
    running = without(running, both(reached, both(gained <= within, settled)));
    take<D>(reached, best.normal, ray);
    take<D>(reached, best.depth, ray_depth);
    // Not at a face: the new corner replaces the one opposite to the edge that the ray is beside. If the ray meets the
    // triangle, that is the edge that stays in the one of three new triangles which the ray meets.
    const D beside_p = dot(ray, cross(p, point.at)), beside_q = dot(ray, cross(q, point.at)),
            beside_r = dot(ray, cross(r, point.at));
    const Mask<D> inside = without(without(running, outside), reached);
    const Mask<D> in_pq = both(inside, both(beside_q >= zero, beside_p <= zero)),
                  in_qr = without(both(inside, both(beside_r >= zero, beside_q <= zero)), in_pq),
                  in_rp = without(without(inside, in_pq), in_qr);
    take<D>(either(off_pq, in_pq), point, portal.r);
    take<D>(either(off_qr, in_qr), point, portal.p);
    take<D>(either(off_rp, in_rp), point, portal.q);
    portal.turn_over(outside);
  }
}

// The i-th direction to start from: between the centres, along the axes of both shapes, along their products, and
// between the centres across the z axis of each, which cylinders need.
inline constexpr std::uint32_t kStartDirections = 16, kCylinderDirections = 18;

template <class V>
CAB_INLINE Vec3<DoubleOf<V>> start_direction(const ContactLanes<V>& pair, std::uint32_t i) {
  using D = DoubleOf<V>;
  const D zero(0.0), one(1.0);
  const Vec3<D> own[3] = {{one, zero, zero}, {zero, one, zero}, {zero, zero, one}};
  if (i == 0) return pair.t;
  if (i < 4) return own[i - 1];
  if (i < 7) return pair.column[i - 4];
  if (i < 16) return cross(own[(i - 7) / 3], pair.column[(i - 7) % 3]);
  const Vec3<D>& axis = i == 16 ? own[2] : pair.column[2];
  return pair.t - dot(pair.t, axis) * axis;
}

// The least depths along the first `directions` start directions, and these directions.
template <class D>
struct Start {
  Vec3<D> normal;
  D depth;
};

// Keeps the best of what it had and another start.
template <class D>
CAB_INLINE void insert(Start<D> start, Start<D> (&best)[kMostStarts]) {
  for (Start<D>& place : best) {
    const Mask<D> less = start.depth < place.depth;
    const D depth = place.depth;
    take<D>(less, start.depth, place.depth);
    take<D>(less, depth, start.depth);
    swap<D>(less, place.normal, start.normal);
  }
}

template <class V>
CAB_INLINE void find_starts(const ContactLanes<V>& pair, std::uint32_t directions,
                            Start<DoubleOf<V>> (&best)[kMostStarts]) {
  using D = DoubleOf<V>;
  const std::uint32_t all = (1u << kWidth<D>)-1;
  const bool is_symmetric = pair.kind_a != ConvexKind::kHull && pair.kind_b != ConvexKind::kHull;
  for (Start<D>& place : best) place.depth = D(std::numeric_limits<double>::infinity());
  const auto try_along = [&](const Vec3<D>& along) {
    insert<D>({along, dot(along, pair.farthest(along, all).at)}, best);
  };
  for (std::uint32_t i = 0; i < directions; ++i) {
    Vec3<D> along = direction_of(start_direction(pair, i));
    take<D>(dot(along, pair.t) < D(0.0), minus(along), along);
    try_along(along);
    if (!is_symmetric && i > 0) try_along(minus(along));
  }
}

// Writes the least exit that rays from the best start directions find in the lanes of `overlap`.
template <class V>
CAB_INLINE void least_exit(const ContactLanes<V>& pair, Closest<V>& closest, Mask<DoubleOf<V>> overlap, Exit<V>& out) {
  using D = DoubleOf<V>;
  // Of boxes, and boxes with round shapes, the start directions are all that can be the best.
  const auto is_complete = [](ConvexKind kind) { return kind == ConvexKind::kBox || kind == ConvexKind::kRound; };
  const bool complete = is_complete(pair.kind_a) && is_complete(pair.kind_b);
  const std::uint32_t starts = complete ? 1 : kMostStarts;
  const bool cylinder = pair.kind_a == ConvexKind::kCylinder || pair.kind_b == ConvexKind::kCylinder;
  Start<D> start[kMostStarts];
  find_starts(pair, cylinder ? kCylinderDirections : kStartDirections, start);
  const Mask<D> open = without(overlap, closest.is_inside);
  if (bits(open)) complete_tetrahedron(pair, start[0].normal, open, closest.corner);
  for (std::uint32_t i = 0; i < starts; ++i) {
    Exit<V> exit;
    exit.normal = start[i].normal;
    exit.depth = start[i].depth;
    for (auto& corner : exit.corner) corner = pair.farthest(exit.normal, bits(overlap));
    follow_rays(pair, closest.corner, overlap, exit);
    const Mask<D> better = i == 0 ? exit.depth <= exit.depth : exit.depth < out.depth;
    take<D>(better, exit.normal, out.normal);
    take<D>(better, exit.depth, out.depth);
    for (int c = 0; c < 3; ++c) take<D>(better, exit.corner[c], out.corner[c]);
  }
}

}  // namespace cab::kernel
