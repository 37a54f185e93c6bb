// Which of sixteen bounds a query meets: nodes of the index of instances, or the leaves of one instance. Bounds are
// lanes, in six arrays: lower x y z, upper x y z. The caller leaves out lanes that hold no bounds.
#pragma once

#include "kernels/simd.h"
#include "layout/tile.h"

#include <cstddef>

namespace cab::kernel {

// Sixteen bounds: those of side s begin at first + s * stride, aligned to 64 bytes.
struct BoundsRow {
  const float* first;
  std::size_t stride;

  CAB_INLINE const float* side(std::uint32_t s) const { return first + s * stride; }
};

// A ray, or a sphere that is moved along it. above = from + pad and below = from - pad, where pad covers the radius and
// all rounding (docs/proof.md, step 12.2). inverse: one over each component of the direction, none of which is 0.
// begin, end: the range of the parameter; end may be infinity.
struct RayLanes {
  float above[3], below[3];
  float inverse[3];
  float begin, end;
};

// Returns the lanes whose bounds the ray meets, and writes at which parameter it enters them, or less.
template <class V>
CAB_INLINE std::uint32_t ray_bounds(const BoundsRow& row, const RayLanes& ray, float* entry) {
  std::uint32_t out = 0;
  for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>) {
    V near(ray.begin), far(ray.end);
    for (std::uint32_t c = 0; c < 3; ++c) {
      const V inverse(ray.inverse[c]);
      const V lo = (Lanes<V>::load(row.side(c) + lane) - V(ray.above[c])) * inverse;
      const V hi = (Lanes<V>::load(row.side(3 + c) + lane) - V(ray.below[c])) * inverse;
      near = max(near, min(lo, hi));
      far = min(far, max(lo, hi));
    }
    Lanes<V>::store(entry + lane, near);
    out |= (~bits(near > far) & ((1u << kWidth<V>)-1)) << lane;
  }
  return out;
}

// Returns the lanes whose bounds are at most as far from a point as the square of a distance says, and writes the
// squares of their distances, or less. above, below: as in RayLanes.
struct PointLanes {
  float above[3], below[3];
  float most_sq;
};
template <class V>
CAB_INLINE std::uint32_t point_bounds(const BoundsRow& row, const PointLanes& point, float* distance_sq) {
  std::uint32_t out = 0;
  for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>) {
    V sum(0.0f);
    for (std::uint32_t c = 0; c < 3; ++c) {
      const V below = Lanes<V>::load(row.side(c) + lane) - V(point.above[c]);
      const V above = V(point.below[c]) - Lanes<V>::load(row.side(3 + c) + lane);
      const V apart = max(V(0.0f), max(below, above));
      sum = sum + apart * apart;
    }
    Lanes<V>::store(distance_sq + lane, sum);
    out |= (~bits(sum > V(point.most_sq)) & ((1u << kWidth<V>)-1)) << lane;
  }
  return out;
}

// Returns the lanes whose bounds overlap other bounds.
template <class V>
std::uint32_t overlap_bounds(const BoundsRow& row, const float (&lo)[3], const float (&hi)[3]) {
  std::uint32_t out = 0;
  for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>) {
    Mask<V> apart = V(0.0f) > V(0.0f);
    for (std::uint32_t c = 0; c < 3; ++c)
      apart = either(apart, either(Lanes<V>::load(row.side(c) + lane) > V(hi[c]),
                                   V(lo[c]) > Lanes<V>::load(row.side(3 + c) + lane)));
    out |= (~bits(apart) & ((1u << kWidth<V>)-1)) << lane;
  }
  return out;
}

// Returns the lanes whose bounds are not wholly beyond a plane: which hold points p with dot(normal, p) <= offset.
template <class V>
std::uint32_t plane_bounds(const BoundsRow& row, const float (&normal)[3], float offset) {
  std::uint32_t out = 0;
  for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>) {
    V lowest(0.0f);
    for (std::uint32_t c = 0; c < 3; ++c) {
      const V n(normal[c]);
      lowest = lowest + min(n * Lanes<V>::load(row.side(c) + lane), n * Lanes<V>::load(row.side(3 + c) + lane));
    }
    out |= (~bits(lowest > V(offset)) & ((1u << kWidth<V>)-1)) << lane;
  }
  return out;
}

}  // namespace cab::kernel
