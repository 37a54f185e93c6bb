// Support functions: the point of a shape that is farthest along a direction.
#pragma once

#include "kernels/vec3.h"
#include "layout/convex_shape.h"
#include "layout/error_bounds.h"

namespace cab::kernel {

// The shapes of one side of a pair of vectors, in their own frames. Round shapes are their segments alone.
template <class V>
struct SupportShape {
  ConvexKind kind;
  Vec3<V> size;
  V scale;                           // hulls: of their vertices
  const ConvexShape* const* shapes;  // hulls: by lane
};

CAB_INLINE std::uint32_t lowest_lane(std::uint32_t lanes) { return static_cast<std::uint32_t>(__builtin_ctz(lanes)); }

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
  for (std::uint32_t c = 1; c < hull.chunk_count; ++c)
    for (std::uint32_t s = 0; s < kSteps; ++s) {
      const V h = height(hull.vertices + c * 3 * kLanes, s);
      const Mask<V> above = h > best[s];
      best[s] = select(above, h, best[s]);
      from[s] = select(above, V(static_cast<float>(c)), from[s]);
    }
  V top = best[0];
  for (std::uint32_t s = 1; s < kSteps; ++s) top = max(top, best[s]);
  const float highest = horizontal_max(top);
  std::uint32_t first = ~0u;
  for (std::uint32_t s = 0; s < kSteps; ++s) {
    std::uint32_t at_top = bits(best[s] >= V(highest));
    alignas(64) float chunk[kWidth<V>];
    Lanes<V>::store(chunk, from[s]);
    for (; at_top; at_top &= at_top - 1) {
      const std::uint32_t lane = lowest_lane(at_top);
      const std::uint32_t vertex = static_cast<std::uint32_t>(chunk[lane]) * kLanes + s * kWidth<V> + lane;
      first = vertex < first ? vertex : first;
    }
  }
  if (first == ~0u) first = 0;  // d holds a NaN
  const float* const at = hull.vertices + first / kLanes * 3 * kLanes + first % kLanes;
  for (std::uint32_t c = 0; c < 3; ++c) out[c] = at[c * kLanes];
}

// The vertices of the hulls in the lanes that are set in `active`; 0 in the others.
template <class V>
CAB_INLINE Vec3<V> hull_vertices(const SupportShape<V>& side, const Vec3<V>& d, std::uint32_t active) {
  alignas(64) float along[3][kWidth<V>], point[3][kWidth<V>] = {};
  const V components[3] = {d.x, d.y, d.z};
  for (int c = 0; c < 3; ++c) Lanes<V>::store(along[c], components[c]);
  for (; active; active &= active - 1) {
    const std::uint32_t lane = lowest_lane(active);
    const ConvexShape& hull = *side.shapes[lane];
    float vertex[3];
    hull_vertex<V>(hull, {along[0][lane], along[1][lane], along[2][lane]}, vertex);
    for (int c = 0; c < 3; ++c) point[c][lane] = vertex[c] * hull.unit;
  }
  return side.scale * Vec3<V>{Lanes<V>::load(point[0]), Lanes<V>::load(point[1]), Lanes<V>::load(point[2])};
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
  if (side.kind == ConvexKind::kHull) return hull_vertices(side, d, active);
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
