// Which of sixteen boxes a query may meet: the leaf boxes of one instance, leaves as lanes. The caller leaves out lanes
// that hold no leaf.
#pragma once

#include "kernels/box.h"
#include "kernels/transpose.h"
#include "layout/error_bounds.h"
#include "layout/rounded_up.h"

#include <limits>

namespace cab::kernel {

// Writes the leaf boxes of the first `live` instances of a tile with leaves as lanes. Those of instance i begin at
// out[i * tile_count(leaves)]. Lanes past the last leaf repeat it.
template <class V>
void boxes_by_leaf(const BoxTile* boxes, std::uint32_t leaves, std::uint32_t live, BoxTile* out) {
  constexpr std::uint32_t kRows = sizeof(BoxTile) / (kLanes * sizeof(float));
  const std::uint32_t tiles = tile_count(leaves);
  for (std::uint32_t tile = 0; tile < tiles; ++tile)
    for (std::uint32_t row = 0; row < kRows; ++row)
      for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>) {
        const float* from[kWidth<V>];
        for (std::uint32_t i = 0; i < kWidth<V>; ++i) {
          const std::uint32_t leaf = tile * kLanes + lane + i;
          from[i] = reinterpret_cast<const float*>(boxes + (leaf < leaves ? leaf : leaves - 1)) + row * kLanes;
        }
        V fields[kLanes];
        Transpose<V>::load(from, fields);
        for (std::uint32_t i = 0; i < live; ++i)
          Lanes<V>::store(reinterpret_cast<float*>(out + i * tiles + tile) + row * kLanes + lane, fields[i]);
      }
}

// A ray, or a sphere that is moved along it, near boxes. Points are at + t direction, with t from `begin` to `end`,
// which may be infinity. rounding: what rounding may move (docs/proof.md, step 12.7). direction: of length 1, to
// rounding.
struct BoxRay {
  float at[3], direction[3];
  float radius, rounding;
  float begin, end;
};

// Whether boxes are larger than they are by all that a ray might miss, or smaller by all that it might not have met.
enum class BoxSize { kLarger, kSmaller };

// Rays near boxes, as lanes. rounding: without what follows from a box.
template <class V>
struct RaysNear {
  Vec3<V> at, direction;
  V radius, rounding;
};

// Narrows the range of each ray, near to far, to where it is in the box of its lane.
template <BoxSize size, class V>
CAB_INLINE void cut_to_box(const BoxLanes<V>& box, const RaysNear<V>& ray, V& near, V& far) {
  const V least(static_cast<float>(kQueryLeastDirection)), skew(kQueryBoxSkew);
  const Vec3<V> to = box.center - ray.at;
  const V pad = ray.rounding + skew * (box.half.x + box.half.y + box.half.z), grow = ray.radius + pad;
  const V by = size == BoxSize::kLarger ? grow : V(0.0f) - pad;
  const V halves[3] = {box.half.x + by, box.half.y + by, box.half.z + by};
  for (int k = 0; k < 3; ++k) {
    const V way = dot(box.axis[k], to), speed = dot(box.axis[k], ray.direction);
    const V inverse = divide(V(1.0f), select(abs(speed) < least, least, speed));
    const V middle = way * inverse, half = halves[k] * abs(inverse);
    near = max(near, middle - half);
    far = min(far, middle + half);
  }
}

template <class V, BoxSize size>
CAB_INLINE std::uint32_t ray_resized_boxes(const BoxTile& boxes, const BoxRay& ray, float end, float* entry) {
  const RaysNear<V> lanes = {{V(ray.at[0]), V(ray.at[1]), V(ray.at[2])},
                             {V(ray.direction[0]), V(ray.direction[1]), V(ray.direction[2])},
                             V(ray.radius),
                             V(ray.rounding)};
  std::uint32_t out = 0;
  for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>) {
    V near(ray.begin), far(end);
    cut_to_box<size>(load_box<V>(boxes, lane), lanes, near, far);
    Lanes<V>::store(entry + lane, near);
    const std::uint32_t met = size == BoxSize::kLarger ? ~bits(near > far) : bits(far >= near);
    out |= (met & ((1u << kWidth<V>)-1)) << lane;
  }
  return out;
}

// Returns the lanes whose boxes the ray may meet, and writes at which t it enters them, or less.
template <class V>
std::uint32_t ray_boxes(const BoxTile& boxes, const BoxRay& ray, float* entry) {
  return ray_resized_boxes<V, BoxSize::kLarger>(boxes, ray, ray.end, entry);
}

// Returns lanes whose boxes the ray surely meets, and writes at which t it has entered them, or more. Of a sphere that
// is moved the centre counts.
template <class V>
std::uint32_t ray_in_boxes(const BoxTile& boxes, const BoxRay& ray, float* entry) {
  return ray_resized_boxes<V, BoxSize::kSmaller>(boxes, ray, ray.end, entry);
}

// A length and its square as floats that are not smaller.
CAB_INLINE float square_above(double length) {
  return float_above(length * length * (1 + kQueryRayPad)) + 4 * std::numeric_limits<float>::min();
}

// The same not larger.
CAB_INLINE float square_below(double length) {
  const float out = float_below(length * length * (1 - kQueryRayPad)) - 4 * std::numeric_limits<float>::min();
  return out > -1 ? out : -1;
}

// Squares of the distances of a point from some boxes, whose root is off by at most what step 12.8 says.
template <class V>
CAB_INLINE V distances_sq(const BoxTile& boxes, std::uint32_t lane, const Vec3<V>& at) {
  const BoxLanes<V> box = load_box<V>(boxes, lane);
  const Vec3<V> to = at - box.center;
  const V x = max(V(0.0f), abs(dot(box.axis[0], to)) - box.half.x);
  const V y = max(V(0.0f), abs(dot(box.axis[1], to)) - box.half.y);
  const V z = max(V(0.0f), abs(dot(box.axis[2], to)) - box.half.z);
  return x * x + y * y + z * z;
}

// Writes them for sixteen boxes.
template <class V>
void point_boxes(const BoxTile& boxes, const float (&point)[3], float* distance_sq) {
  const Vec3<V> at = {V(point[0]), V(point[1]), V(point[2])};
  for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>)
    Lanes<V>::store(distance_sq + lane, distances_sq<V>(boxes, lane, at));
}

}  // namespace cab::kernel
