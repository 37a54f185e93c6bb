// Pairs of shapes in lanes of doubles, for contacts: posed from the caller's poses, in the frame of a's shape, and
// scaled to size 1. Kernels of contacts are compiled for V, a vector of floats, and compute in DoubleOf<V>.
#pragma once

#include "kernels/convex/convex_block.h"
#include "kernels/convex/gjk.h"

namespace cab::kernel {

// The records of sixteen shapes by float, and their axes in double by component.
struct ShapeTile {
  alignas(64) float record[16][kLanes];
  alignas(64) double axis[9][kLanes];
};

template <class V>
CAB_INLINE void read_shapes(const ConvexShape* const (&shapes)[kLanes], ShapeTile& out) {
  for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>) {
    const float* rows[kWidth<V>];
    for (std::uint32_t i = 0; i < kWidth<V>; ++i) rows[i] = reinterpret_cast<const float*>(shapes[lane + i]);
    V f[16];
    Transpose<V>::load(rows, f);
    for (int k = 0; k < 16; ++k) Lanes<V>::store(out.record[k] + lane, f[k]);
  }
  for (std::uint32_t lane = 0; lane < kLanes; ++lane)
    for (int k = 0; k < 9; ++k) out.axis[k][lane] = shapes[lane]->axis[k / 3][k % 3];
}

template <class D>
CAB_INLINE ShapeLanes<D> load_shapes(const ShapeTile& shapes, std::uint32_t lane) {
  const auto record = [&](int k) { return Lanes<D>::load(shapes.record[k] + lane); };
  const auto axis = [&](int k) { return Lanes<D>::load(shapes.axis[k] + lane); };
  return {{record(0), record(1), record(2)},
          {{axis(0), axis(1), axis(2)}, {axis(3), axis(4), axis(5)}, {axis(6), axis(7), axis(8)}},
          {record(12), record(13), record(14)},
          record(15)};
}

// One side of a block of pairs, ready for lanes.
struct ContactSide {
  ShapeTile shapes;
  RawSide raw;
};

template <class V>
CAB_INLINE void read_contact_side(const ConvexSide& side, ContactSide& out) {
  read_shapes<V>(side.shape, out.shapes);
  read_side<V>(side, out.raw);
}

// A point of the difference a - b, and the point of a that it comes from. In the frame of a's shape, without the balls
// about round shapes.
template <class D>
struct DifferencePoint {
  Vec3<D> at, on_a;
};

template <class D>
CAB_INLINE const Vec3<D>& place_of(const DifferencePoint<D>& point) {
  return point.at;
}

template <class D>
CAB_INLINE void take(Mask<D> m, const DifferencePoint<D>& from, DifferencePoint<D>& to) {
  take<D>(m, from.at, to.at);
  take<D>(m, from.on_a, to.on_a);
}

template <class D>
CAB_INLINE Vec3<D> minus(const Vec3<D>& v) {
  return {D(0.0) - v.x, D(0.0) - v.y, D(0.0) - v.z};
}

// Pairs as lanes. Lengths are scaled but for those of the poses.
template <class V>
struct ContactLanes {
  using D = DoubleOf<V>;
  ConvexKind kind_a, kind_b;
  const ConvexShape* const* shapes_a;  // by lane
  const ConvexShape* const* shapes_b;
  std::uint32_t used;  // the lanes that are in use
  bool has_margin;     // whether links that are apart have contacts, too
  D scale;
  Vec3<D> column_a[3], center_a;  // of a's shape, relative to the origin of its instance, in world axes; not scaled
  Vec3<D> column[3], t;           // of b's shape
  Vec3<D> size_a, size_b;
  D scale_a, scale_b;    // by which the lengths of each shape are multiplied
  D radius_a, radius_b;  // of the balls about round shapes, else 0
  D reach;               // of both shapes together
  D slack, rounding;     // PairLanes::slack, and of a product of three edges of the difference

  // A hull's vertices farthest along d by heights in float, in a's or b's own axes.
  static CAB_NOINLINE Vec3<D> hull_points(const ConvexShape* const* shapes, const Vec3<D>& d, std::uint32_t active) {
    alignas(64) double along[3][kWidth<D>], point[3][kWidth<D>] = {};
    const D norm = max(max_component(abs(d)), D(kLeastNormal));
    const D components[3] = {d.x, d.y, d.z};
    for (int c = 0; c < 3; ++c) Lanes<D>::store(along[c], divide(components[c], norm));
    for (; active; active &= active - 1) {
      const std::uint32_t lane = lowest_bit(active);
      const ConvexShape& hull = *shapes[lane];
      const float by[3] = {static_cast<float>(along[0][lane]), static_cast<float>(along[1][lane]),
                           static_cast<float>(along[2][lane])};
      float vertex[3];
      hull_vertex<V>(hull, by, vertex);
      for (int c = 0; c < 3; ++c) point[c][lane] = static_cast<double>(vertex[c]) * static_cast<double>(hull.unit);
    }
    return {Lanes<D>::load(point[0]), Lanes<D>::load(point[1]), Lanes<D>::load(point[2])};
  }

  // The point of each shape farthest along d, for hulls to rounding in float. Lanes outside of `active` may hold
  // anything.
  CAB_INLINE Vec3<D> farthest_of_a(const Vec3<D>& d, std::uint32_t active) const {
    return kind_a == ConvexKind::kHull ? scale_a * hull_points(shapes_a, d, active)
                                       : support_by_size(kind_a, size_a, d);
  }
  CAB_INLINE Vec3<D> farthest_of_b(const Vec3<D>& d, std::uint32_t active) const {
    const Vec3<D> local = {dot(column[0], d), dot(column[1], d), dot(column[2], d)};
    return t + rotate(column, kind_b == ConvexKind::kHull ? scale_b * hull_points(shapes_b, local, active)
                                                          : support_by_size(kind_b, size_b, local));
  }

  // The point of the difference farthest along d, likewise.
  CAB_NOINLINE DifferencePoint<D> farthest(const Vec3<D>& d, std::uint32_t active) const {
    const Vec3<D> on_a = farthest_of_a(d, active);
    return {on_a - farthest_of_b(minus(d), active), on_a};
  }
};

// A common normal of both shapes, and a point of each without the balls about round shapes, in the frame of a.
template <class D>
struct Touching {
  Vec3<D> normal, on_a, on_b;
};

// The lanes that D covers, from `lane` on.
template <class V>
CAB_INLINE ContactLanes<V> contact_lanes(const ConvexBlock& block, const ContactSide& read_a, const ContactSide& read_b,
                                         std::uint32_t lane) {
  using D = DoubleOf<V>;
  const PosedShape<D> a = pose_shape<D>(block.a, read_a.raw, lane, load_shapes<D>(read_a.shapes, lane)),
                      b = pose_shape<D>(block.b, read_b.raw, lane, load_shapes<D>(read_b.shapes, lane));
  ContactLanes<V> out;
  out.kind_a = block.a.shape[0]->kind;
  out.kind_b = block.b.shape[0]->kind;
  out.shapes_a = block.a.shape + lane;
  out.shapes_b = block.b.shape + lane;
  const std::uint32_t used = block.count > lane ? block.count - lane : 0;
  out.used = (1u << (used < kWidth<D> ? used : kWidth<D>)) - 1;
  out.has_margin = block.margin[0] > 0;
  out.scale = Lanes<D>::load(block.scale + lane);
  for (int k = 0; k < 3; ++k) out.column_a[k] = a.column[k];
  out.center_a = a.center;
  const Vec3<D> shift = {Lanes<D>::load(block.shift.by[0] + lane), Lanes<D>::load(block.shift.by[1] + lane),
                         Lanes<D>::load(block.shift.by[2] + lane)};
  const Vec3<D> between = (b.center - a.center) + shift;
  const auto in_a = [&](const Vec3<D>& v) {
    return Vec3<D>{dot(a.column[0], v), dot(a.column[1], v), dot(a.column[2], v)};
  };
  for (int k = 0; k < 3; ++k) out.column[k] = in_a(b.column[k]);
  out.t = out.scale * in_a(between);
  out.size_a = out.scale * a.size;
  out.size_b = out.scale * b.size;
  out.scale_a = out.scale * a.scale;
  out.scale_b = out.scale * b.scale;
  const D zero(0.0);
  out.radius_a = out.kind_a == ConvexKind::kRound ? out.size_a.x : zero;
  out.radius_b = out.kind_b == ConvexKind::kRound ? out.size_b.x : zero;
  out.reach = out.scale * (a.reach + b.reach);
  const D size = sum(abs(out.t)) + out.reach;
  out.slack = D(kConvexSlackDouble) * size + D(kConvexPoseSlackDouble) * (out.scale * (a.away + b.away));
  out.rounding = D(kTetrahedronRoundingDouble) * (size * (out.reach * out.reach));
  return out;
}

}  // namespace cab::kernel
