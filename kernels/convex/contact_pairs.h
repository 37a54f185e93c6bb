// The contacts of a block of pairs of shapes.
#pragma once

#include "kernels/convex/closed_forms.h"
#include "kernels/convex/depth_search.h"
#include "kernels/convex/ellipsoid_depth.h"
#include "kernels/convex/least_depth.h"

#include <limits>

namespace cab::kernel {

// Closest points of two segments (Ericson 2005, 5.1.9). Where both are inside of their segments, the normal of both
// segments is exact; where the segments meet, any normal of both is.
template <class V>
CAB_INLINE Touching<DoubleOf<V>> round_contact(const ContactLanes<V>& pair) {
  using D = DoubleOf<V>;
  const D zero(0.0);
  const D half_a = pair.size_a.z, half_b = pair.size_b.z;
  const Vec3<D>& axis = pair.column[2];
  const Vec3<D> across = {zero - axis.y, axis.x, zero};  // of z and the axis of b
  const D sine_sq = dot(across, across), t_axis = dot(pair.t, axis);
  const Mask<D> crossing = sine_sq > D(kParallelInDouble);
  D s = divide(pair.t.z - axis.z * t_axis, sine_sq);
  s = clamped(select(crossing, s, zero), half_a);
  D r = clamped(s * axis.z - t_axis, half_b);
  s = clamped(pair.t.z + r * axis.z, half_a);
  r = clamped(s * axis.z - t_axis, half_b);
  const Vec3<D> on_a = {zero, zero, s}, on_b = pair.t + r * axis, between = on_b - on_a;
  const Mask<D> inside = both(crossing, both(abs(s) < half_a, abs(r) < half_b));
  const Mask<D> meet = dot(between, between) <= D(kMeetingSegments) * (pair.reach * pair.reach);
  Vec3<D> common = direction_of(across);
  common = choose<D>(dot(common, between) < zero, minus(common), common);
  return {choose<D>(either(inside, meet), common, direction_of(between)), on_a, on_b};
}

// Whether the faces and edges of two shapes are searched: those of a hull, and of what is no smooth shape with it.
CAB_INLINE bool is_by_faces(ConvexKind a, ConvexKind b) {
  const auto has_edges = [](ConvexKind kind) {
    return kind == ConvexKind::kHull || kind == ConvexKind::kBox || kind == ConvexKind::kRound;
  };
  return has_edges(a) && has_edges(b) && (a == ConvexKind::kHull || b == ConvexKind::kHull);
}

// The lanes of polytopes, as bits: those that have a contact by their faces and edges, and those of them that may be
// apart without their balls.
struct PolytopeLanes {
  std::uint32_t found = 0, apart = 0;
};

// Contacts of polytopes that overlap, or nearly do, without their balls. lanes: those to find them in, as bits.
template <class V>
CAB_NOINLINE PolytopeLanes polytope_contact(const ContactLanes<V>& pair, std::uint32_t lanes,
                                            Touching<DoubleOf<V>>& out) {
  using D = DoubleOf<V>;
  constexpr std::uint32_t kWide = kWidth<D>;
  alignas(64) double column[3][3][kWide], t[3][kWide], slack[kWide], found[9][kWide] = {};
  struct {
    alignas(64) double size[3][kWide], scale[kWide];
  } sides[2];
  const auto store = [](double(&to)[3][kWide], const Vec3<D>& from) {
    Lanes<D>::store(to[0], from.x);
    Lanes<D>::store(to[1], from.y);
    Lanes<D>::store(to[2], from.z);
  };
  const auto load = [](const double(*from)[kWide]) {
    return Vec3<D>{Lanes<D>::load(from[0]), Lanes<D>::load(from[1]), Lanes<D>::load(from[2])};
  };
  for (int k = 0; k < 3; ++k) store(column[k], pair.column[k]);
  store(t, pair.t);
  store(sides[0].size, pair.size_a);
  store(sides[1].size, pair.size_b);
  Lanes<D>::store(sides[0].scale, pair.scale_a);
  Lanes<D>::store(sides[1].scale, pair.scale_b);
  Lanes<D>::store(slack, pair.slack);
  PolytopeLanes which;
  for (; lanes; lanes &= lanes - 1) {
    const std::uint32_t i = lowest_bit(lanes);
    const auto at = [i](const double(&from)[3][kWide]) { return Double3{from[0][i], from[1][i], from[2][i]}; };
    const auto side = [&](const ConvexShape& shape, std::uint32_t s) {
      const Double3 size = at(sides[s].size);
      if (shape.kind == ConvexKind::kRound) return DepthSide{nullptr, {0, 0, size.z}};
      if (shape.kind == ConvexKind::kBox) return DepthSide{shape.polytope, size};
      const double unit = sides[s].scale[i] * static_cast<double>(shape.unit);
      return DepthSide{shape.polytope, {unit, unit, unit}};
    };
    const ConvexShape &a = *pair.shapes_a[i], &b = *pair.shapes_b[i];
    if ((a.kind != ConvexKind::kRound && !a.polytope) || (b.kind != ConvexKind::kRound && !b.polytope)) continue;
    // So far apart that float has no digits left for the shapes.
    if (!(sum(abs(at(t))) < kFarPolytopes)) continue;
    LeastDepth least;
    least_depth<V>({side(a, 0), side(b, 1), {at(column[0]), at(column[1]), at(column[2])}, at(t)}, least);
    which.found |= 1u << i;
    which.apart |= least.depth > slack[i] ? 0 : 1u << i;
    const Double3* const vectors[3] = {&least.normal, &least.on_a, &least.on_b};
    for (int v = 0; v < 3; ++v) {
      found[3 * v][i] = vectors[v]->x;
      found[3 * v + 1][i] = vectors[v]->y;
      found[3 * v + 2][i] = vectors[v]->z;
    }
  }
  out = {load(found), load(found + 3), load(found + 6)};
  return which;
}

// The lanes of some bits.
template <class D>
CAB_INLINE Mask<D> lanes_of(std::uint32_t bits) {
  alignas(64) double is_set[kWidth<D>];
  for (std::uint32_t i = 0; i < kWidth<D>; ++i) is_set[i] = static_cast<double>(bits >> i & 1);
  return Lanes<D>::load(is_set) > D(0.0);
}

// By faces and edges where the shapes have them, else by GJK, and where the shapes overlap without their balls, a
// search for the least depth. Most shapes within a margin are apart: then GJK comes first, and shapes that it parts
// need no faces and edges.
template <class V>
CAB_NOINLINE Touching<DoubleOf<V>> searched_contact(const ContactLanes<V>& pair) {
  using D = DoubleOf<V>;
  Touching<D> by_faces;
  PolytopeLanes which;
  const Mask<D> all = D(0.0) <= D(0.0);
  Mask<D> lanes = all, known = without(all, all);
  const bool has_faces = is_by_faces(pair.kind_a, pair.kind_b);
  if (has_faces) {
    std::uint32_t left = pair.used;
    if (!pair.has_margin) {
      which = polytope_contact(pair, left, by_faces);
      left &= ~which.found | which.apart;
      if (!left) return by_faces;
    }
    lanes = lanes_of<D>(left);
  }
  Closest<V> closest = find_closest(pair, lanes);
  if (has_faces) {
    if (pair.has_margin) {
      const Mask<D> far = dot(closest.normal, closest.normal) > D(kFarApart * kFarApart);
      which = polytope_contact(pair, pair.used & ~bits(both(closest.is_apart, far)), by_faces);
    }
    known = without(lanes_of<D>(which.found), both(lanes_of<D>(which.apart), closest.is_apart));
  }
  Vec3<D> normal = minus(closest.normal), on_difference = closest.normal;
  DifferencePoint<D>(&corner)[4] = closest.corner;
  const Mask<D> overlap = without(without(lanes, closest.is_apart), known);
  if (bits(overlap)) {
    Exit<V> exit;
    least_exit(pair, closest, overlap, exit);
    take<D>(overlap, exit.normal, normal);
    take<D>(overlap, exit.depth * exit.normal, on_difference);
    for (int i = 0; i < 3; ++i) take<D>(overlap, exit.corner[i], corner[i]);
  }
  D to_e, to_f;
  weights_at(corner, on_difference, to_e, to_f);
  const auto mean = [&](Vec3<D> DifferencePoint<D>::*at) {
    return corner[0].*at + (to_e * (corner[1].*at - corner[0].*at) + to_f * (corner[2].*at - corner[0].*at));
  };
  const Vec3<D> on_a = mean(&DifferencePoint<D>::on_a);
  Touching<D> out = {direction_of(normal), on_a, on_a - mean(&DifferencePoint<D>::at)};
  if (!bits(known)) return out;
  take<D>(known, by_faces.normal, out.normal);
  take<D>(known, by_faces.on_a, out.on_a);
  take<D>(known, by_faces.on_b, out.on_b);
  return out;
}

// Newton's method; where it is stuck, as for needles, the better of its answer and the search's.
template <class V>
CAB_INLINE Touching<DoubleOf<V>> ellipsoid_contact_or_search(const ContactLanes<V>& pair) {
  using D = DoubleOf<V>;
  Mask<D> stuck;
  Touching<D> touching = ellipsoid_contact(pair, stuck);
  if (!bits(stuck)) return touching;
  const Touching<D> found = searched_contact(pair);
  const Mask<D> better =
      both(stuck, ellipsoid_support(pair, found.normal).height < ellipsoid_support(pair, touching.normal).height);
  take<D>(better, found.normal, touching.normal);
  take<D>(better, found.on_a, touching.on_a);
  take<D>(better, found.on_b, touching.on_b);
  return touching;
}

// The contact of a half space with the lowest point of another shape above its plane. Two half spaces have none.
template <class V>
CAB_INLINE Touching<DoubleOf<V>> half_space_contact(const ContactLanes<V>& pair) {
  using D = DoubleOf<V>;
  constexpr std::uint32_t kAll = (1u << kWidth<D>)-1;
  const D zero(0.0), one(1.0);
  if (pair.kind_a != ConvexKind::kHalfSpace) {
    const Vec3<D>& up = pair.column[2];
    const Vec3<D> lowest = pair.farthest_of_a(minus(up), kAll);
    return {minus(up), lowest, lowest - dot(up, lowest - pair.t) * up};
  }
  if (pair.kind_b != ConvexKind::kHalfSpace) {
    const Vec3<D> lowest = pair.farthest_of_b({zero, zero, zero - one}, kAll);
    return {{zero, zero, one}, {lowest.x, lowest.y, zero}, lowest};
  }
  const Vec3<D> none = {zero, zero, zero};
  return {none, none, none};
}

// How far a hull reaches along d from its shape's centre. d: in the shape's axes, in the caller's unit per scaled unit.
// A template, so that its name says for which instruction set it is compiled.
template <class D>
double hull_height(const ConvexShape& hull, const Vec3<double>& d) {
  const auto at = [](const float* v, int c) { return static_cast<double>(v[c]); };
  double offset = 0;  // of the part's origin from the centre
  const double along[3] = {d.x, d.y, d.z};
  for (int k = 0; k < 3; ++k)
    for (int c = 0; c < 3; ++c)
      offset += along[k] * hull.axis[k][c] * (at(hull.part->position, c) - at(hull.position, c));
  const Span<const float> vertices = hull.part->vertices;
  double highest = -std::numeric_limits<double>::infinity();
  for (std::size_t v = 0; v < vertices.size; v += 3) {
    const float* const p = vertices.data + v;
    highest = max(highest, (at(p, 0) * d.x + at(p, 1) * d.y) + at(p, 2) * d.z);
  }
  return highest + offset;
}

// How far each shape reaches along d, a direction in its own axes, without its ball; for hulls by their vertices as
// given, and half spaces along the normal of their plane.
template <class D>
CAB_INLINE D height_of(ConvexKind kind, const Vec3<D>& size, D scale, const ConvexShape* const* shapes,
                       const Vec3<D>& d) {
  if (kind == ConvexKind::kHalfSpace) return D(0.0);
  if (kind != ConvexKind::kHull) return dot(d, support_by_size(kind, size, d));
  alignas(64) double along[3][kWidth<D>], height[kWidth<D>];
  const D components[3] = {d.x, d.y, d.z};
  for (int c = 0; c < 3; ++c) Lanes<D>::store(along[c], components[c]);
  for (std::uint32_t i = 0; i < kWidth<D>; ++i)
    height[i] = hull_height<D>(*shapes[i], {along[0][i], along[1][i], along[2][i]});
  return scale * Lanes<D>::load(height);
}

// The contacts of the sixteen pairs of a block.
template <class V>
void contact_pairs(const ConvexBlock& block, ConvexContacts& out) {
  using D = DoubleOf<V>;
  ContactSide read_a, read_b;
  read_contact_side<V>(block.a, read_a);
  read_contact_side<V>(block.b, read_b);
  for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<D>) {
    const ContactLanes<V> pair = contact_lanes<V>(block, read_a, read_b, lane);
    Touching<D> touching;
    if (pair.kind_a == ConvexKind::kHalfSpace || pair.kind_b == ConvexKind::kHalfSpace)
      touching = half_space_contact(pair);
    else if (pair.kind_a == ConvexKind::kRound && pair.kind_b == ConvexKind::kRound)
      touching = round_contact(pair);
    else if (pair.kind_a == ConvexKind::kEllipsoid && pair.kind_b == ConvexKind::kEllipsoid)
      touching = ellipsoid_contact_or_search(pair);
    else
      touching = searched_contact(pair);

    const Vec3<D>& normal = touching.normal;
    const Vec3<D> away = minus(normal);
    const Vec3<D> local_b = {dot(pair.column[0], away), dot(pair.column[1], away), dot(pair.column[2], away)};
    const D core = (height_of(pair.kind_a, pair.size_a, pair.scale_a, pair.shapes_a, normal) +
                    height_of(pair.kind_b, pair.size_b, pair.scale_b, pair.shapes_b, local_b)) -
                   dot(normal, pair.t);
    const D unit = divide(D(1.0), pair.scale);
    Lanes<D>::store(out.depth + lane, unit * (core + (pair.radius_a + pair.radius_b)));
    store3(out.normal, lane, rotate(pair.column_a, normal));
    const auto in_world = [&](const Vec3<D>& at) { return pair.center_a + rotate(pair.column_a, unit * at); };
    store3(out.point_a, lane, in_world(touching.on_a + pair.radius_a * normal));
    store3(out.point_b, lane, in_world(touching.on_b - pair.radius_b * normal));
  }
}

}  // namespace cab::kernel
