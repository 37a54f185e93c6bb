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

  // Whether what is entered then is not wanted any more.
  CAB_INLINE bool skips(float entry) const { return entry > end; }
};

// A ray that is compared with many bounds: the sides on which it enters and leaves them follow from its direction.
template <class V>
class RayWalk {
 public:
  explicit CAB_INLINE RayWalk(const RayLanes& ray) : ray_(ray) {
    for (std::uint32_t c = 0; c < 3; ++c) {
      const std::uint32_t is_back = ray.inverse[c] < 0;  // a number: directions are not to be predicted
      const float* const from[2] = {ray.above, ray.below};
      near_side_[c] = c + 3 * is_back;
      far_side_[c] = c + 3 - 3 * is_back;
      near_[c] = V(from[is_back][c]);
      far_[c] = V(from[1 - is_back][c]);
      inverse_[c] = V(ray.inverse[c]);
    }
  }

  // Returns the lanes whose bounds the ray meets, and writes at which parameter it enters them, or less.
  CAB_INLINE std::uint32_t operator()(const BoundsRow& row, float* entry) const {
    std::uint32_t out = 0;
    for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>) {
      V near(ray_.begin), far(ray_.end);
      for (std::uint32_t c = 0; c < 3; ++c) {
        near = max(near, (Lanes<V>::load(row.side(near_side_[c]) + lane) - near_[c]) * inverse_[c]);
        far = min(far, (Lanes<V>::load(row.side(far_side_[c]) + lane) - far_[c]) * inverse_[c]);
      }
      Lanes<V>::store(entry + lane, near);
      out |= (~bits(near > far) & ((1u << kWidth<V>)-1)) << lane;
    }
    return out;
  }

 private:
  const RayLanes& ray_;
  std::uint32_t near_side_[3], far_side_[3];
  V near_[3], far_[3], inverse_[3];
};

// Returns the lanes whose bounds are at most as far from a point as the square of a distance says, and writes the
// squares of their distances, or less. above, below: as in RayLanes.
struct PointLanes {
  float above[3], below[3];
  float most_sq;

  // Whether what is so far away is not wanted any more.
  CAB_INLINE bool skips(float distance_sq) const { return distance_sq > most_sq; }
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
