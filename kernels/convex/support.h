// Support functions: the point of a shape that is farthest along a direction.
#pragma once

#include "kernels/vec3.h"
#include "layout/compiler.h"
#include "layout/convex_shape.h"
#include "layout/error_bounds.h"

namespace cab::kernel {

// Whether hull_vertex_by_lane is faster than hull_vertex for each of so many lanes.
CAB_INLINE bool pays_by_lane(std::uint32_t lanes, const ConvexShape& hull) {
  return lanes > 1 && 6 * lanes >= 6 + hull.vertex_count;
}

// The hulls of lanes. Lanes in a row that have the same hull are a run if there are many of them.
template <class V>
struct HullLanes {
  const ConvexShape* const* shapes = nullptr;  // by lane
  std::uint32_t one_by_one = 0;                // the lanes that are in no run
  std::uint32_t run_count = 0;
  struct {
    const ConvexShape* hull;
    std::uint32_t lanes;
  } runs[kWidth<V>];
  alignas(64) float run_of[kWidth<V>];  // by lane, -1 in those that are in no run; set if there are runs

  CAB_INLINE void find(const ConvexShape* const* by_lane) {
    shapes = by_lane;
    for (std::uint32_t begin = 0, end; begin < kWidth<V>; begin = end) {
      end = begin + 1;
      while (end < kWidth<V> && shapes[end] == shapes[begin]) ++end;
      const std::uint32_t lanes = (1u << end) - (1u << begin);
      if (!pays_by_lane(end - begin, *shapes[begin])) {
        one_by_one |= lanes;
        continue;
      }
      if (run_count == 0) Lanes<V>::store(run_of, V(-1.0f));
      for (std::uint32_t lane = begin; lane < end; ++lane) run_of[lane] = static_cast<float>(run_count);
      runs[run_count++] = {shapes[begin], lanes};
    }
  }
};

// The shapes of one side of a pair of vectors, in their own frames. Round shapes are their segments alone.
template <class V>
struct SupportShape {
  ConvexKind kind;
  Vec3<V> size;
  V scale;             // hulls: of their vertices
  HullLanes<V> hulls;  // hulls only
};

// The vertex of a hull farthest along d, of several the one that comes first in the hull's order. V's lanes are
// vertices here.
template <class V>
CAB_INLINE void hull_vertex(const ConvexShape& hull, const float (&d)[3], float (&out)[3]) {
  constexpr std::uint32_t kSteps = kLanes / kWidth<V>;
  const V dx(d[0]), dy(d[1]), dz(d[2]);
  const auto height = [&](const float* chunk, std::uint32_t step) {
    const float* const at = chunk + step * kWidth<V>;
    return Lanes<V>::load(at) * dx + Lanes<V>::load(at + kLanes) * dy + Lanes<V>::load(at + 2 * kLanes) * dz;
  };
  V best[kSteps], from[kSteps];  // by lane: the greatest height, and the first chunk with it
  for (std::uint32_t s = 0; s < kSteps; ++s) {
    best[s] = height(hull.vertices, s);
    from[s] = V(0.0f);
  }
  const std::uint32_t chunks = (hull.vertex_count + kLanes - 1) / kLanes;
  for (std::uint32_t c = 1; c < chunks; ++c)
    for (std::uint32_t s = 0; s < kSteps; ++s) {
      const V h = height(hull.vertices + c * 3 * kLanes, s);
      const Mask<V> above = h > best[s];
      best[s] = select(above, h, best[s]);
      from[s] = select(above, V(static_cast<float>(c)), from[s]);
    }
  V top = best[0];
  for (std::uint32_t s = 1; s < kSteps; ++s) top = max(top, best[s]);
  top = V(horizontal_max(top));
  std::uint32_t first = ~0u;
  for (std::uint32_t s = 0; s < kSteps; ++s) {
    std::uint32_t at_top = bits(best[s] >= top);
    if (chunks == 1) at_top &= 0u - at_top;  // the first is enough
    alignas(64) float chunk[kWidth<V>];
    Lanes<V>::store(chunk, from[s]);
    for (; at_top; at_top &= at_top - 1) {
      const std::uint32_t lane = lowest_bit(at_top);
      const std::uint32_t vertex = static_cast<std::uint32_t>(chunk[lane]) * kLanes + s * kWidth<V> + lane;
      first = vertex < first ? vertex : first;
    }
  }
  if (first == ~0u) first = 0;  // d holds a NaN
  const float* const at = hull.vertices + first / kLanes * 3 * kLanes + first % kLanes;
  for (std::uint32_t c = 0; c < 3; ++c) out[c] = at[c * kLanes];
}

// The vertices of one hull farthest along d, the same as by hull_vertex. V's lanes are directions here.
template <class V>
CAB_INLINE Vec3<V> hull_vertex_by_lane(const ConvexShape& hull, const Vec3<V>& d) {
  const auto vertex = [&](std::uint32_t v) {
    const float* const at = hull.vertices + v / kLanes * 3 * kLanes + v % kLanes;
    return Vec3<V>{V(at[0]), V(at[kLanes]), V(at[2 * kLanes])};
  };
  const auto height = [&](const Vec3<V>& at) { return at.x * d.x + at.y * d.y + at.z * d.z; };
  Vec3<V> out = vertex(0);
  V highest = height(out);
  for (std::uint32_t v = 1; v < hull.vertex_count; ++v) {
    const Vec3<V> at = vertex(v);
    const V height_at = height(at);
    const Mask<V> above = height_at > highest;
    take<V>(above, height_at, highest);
    take<V>(above, at, out);
  }
  return out;
}

// The vertices of hulls in the given lanes, one after the other. hull_of(lane): the hull.
template <class V, class HullOf>
CAB_INLINE Vec3<V> hull_vertices_in_turn(const HullOf& hull_of, const Vec3<V>& d, std::uint32_t lanes) {
  alignas(64) float along[3][kWidth<V>], point[3][kWidth<V>] = {};
  const V components[3] = {d.x, d.y, d.z};
  for (int c = 0; c < 3; ++c) Lanes<V>::store(along[c], components[c]);
  for (; lanes; lanes &= lanes - 1) {
    const std::uint32_t lane = lowest_bit(lanes);
    const ConvexShape& hull = hull_of(lane);
    float vertex[3];
    hull_vertex<V>(hull, {along[0][lane], along[1][lane], along[2][lane]}, vertex);
    for (int c = 0; c < 3; ++c) point[c][lane] = vertex[c] * hull.unit;
  }
  return {Lanes<V>::load(point[0]), Lanes<V>::load(point[1]), Lanes<V>::load(point[2])};
}

// The vertices of one hull in the lanes that are set in `active`. Other lanes may hold anything.
template <class V>
CAB_INLINE Vec3<V> hull_vertices(const ConvexShape& hull, const Vec3<V>& d, std::uint32_t active) {
  if (pays_by_lane(count_bits(active), hull)) return V(hull.unit) * hull_vertex_by_lane(hull, d);
  return hull_vertices_in_turn([&hull](std::uint32_t) -> const ConvexShape& { return hull; }, d, active);
}

// The same of the hulls of lanes.
template <class V>
CAB_INLINE Vec3<V> hull_vertices(const HullLanes<V>& hulls, const Vec3<V>& d, std::uint32_t active) {
  const auto hull_of = [&hulls](std::uint32_t lane) -> const ConvexShape& { return *hulls.shapes[lane]; };
  Vec3<V> out = hull_vertices_in_turn(hull_of, d, hulls.one_by_one & active);
  for (std::uint32_t i = 0; i < hulls.run_count; ++i) {
    if (!(hulls.runs[i].lanes & active)) continue;
    const ConvexShape& hull = *hulls.runs[i].hull;
    const V run(static_cast<float>(i)), run_of = Lanes<V>::load(hulls.run_of);
    const Mask<V> in_run = both(run_of >= run, run_of <= run);
    take<V>(in_run, V(hull.unit) * hull_vertex_by_lane(hull, d), out);
  }
  return out;
}

// v with the sign of s.
template <class V>
CAB_INLINE V with_sign(V v, V s) {
  return select(s < V(0.0f), V(0.0f) - v, v);
}

// What is added to the square of a length across a cylinder's axis.
template <class V>
CAB_INLINE V across_tiny() {
  if constexpr (kIsDouble<V>) {
    return V(kAcrossTinyDouble);
  } else {
    return V(kAcrossTiny);
  }
}

// The point farthest along d of a shape that its size describes: any but a hull or a half space.
template <class V>
CAB_INLINE Vec3<V> support_by_size(ConvexKind kind, const Vec3<V>& s, const Vec3<V>& d) {
  if (kind == ConvexKind::kRound) return {V(0.0f), V(0.0f), with_sign(s.z, d.z)};
  if (kind == ConvexKind::kBox) return {with_sign(s.x, d.x), with_sign(s.y, d.y), with_sign(s.z, d.z)};
  if (kind == ConvexKind::kCylinder) {
    const V by = divide(s.x, sqrt((d.x * d.x + d.y * d.y) + across_tiny<V>()));
    return {by * d.x, by * d.y, with_sign(s.z, d.z)};
  }
  const Vec3<V> n = {s.x * d.x, s.y * d.y, s.z * d.z};
  const V by = divide(V(1.0f), sqrt(dot(n, n)));
  return {s.x * (n.x * by), s.y * (n.y * by), s.z * (n.z * by)};
}

// The point of each shape farthest along d. Lanes outside of `active` may hold anything.
template <class V>
CAB_INLINE Vec3<V> support(const SupportShape<V>& side, const Vec3<V>& d, std::uint32_t active) {
  if (side.kind == ConvexKind::kHull) return side.scale * hull_vertices(side.hulls, d, active);
  return support_by_size(side.kind, side.size, d);
}

// The difference of the two shapes of each lane, in the frame of a.
template <class V>
struct Difference {
  SupportShape<V> a, b;
  Vec3<V> column[3];  // the axes of b
  Vec3<V> t;          // its centre

  // The point of b farthest along d.
  CAB_INLINE Vec3<V> farthest_of_b(const Vec3<V>& d, std::uint32_t active) const {
    return t + rotate(column, support(b, {dot(column[0], d), dot(column[1], d), dot(column[2], d)}, active));
  }

  // The point of a - b farthest along d.
  CAB_INLINE Vec3<V> farthest(const Vec3<V>& d, std::uint32_t active) const {
    const V zero(0.0f);
    return support(a, d, active) - farthest_of_b({zero - d.x, zero - d.y, zero - d.z}, active);
  }
};

}  // namespace cab::kernel
