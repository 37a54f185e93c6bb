// Which of sixteen boxes a query may meet: the leaf boxes of one instance, leaves as lanes. The caller leaves out lanes
// that hold no leaf.
#pragma once

#include "kernels/box.h"
#include "kernels/transpose.h"
#include "layout/error_bounds.h"

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
// which may be infinity. pad: the radius and what rounding may move (docs/proof.md, step 12.7). direction: of length 1,
// to rounding.
struct BoxRay {
  float at[3], direction[3];
  float pad;
  float begin, end;
};

// Returns the lanes whose boxes the ray may meet, and writes at which t it enters them, or less.
template <class V>
std::uint32_t ray_boxes(const BoxTile& boxes, const BoxRay& ray, float* entry) {
  const Vec3<V> at = {V(ray.at[0]), V(ray.at[1]), V(ray.at[2])};
  const Vec3<V> direction = {V(ray.direction[0]), V(ray.direction[1]), V(ray.direction[2])};
  const V least(static_cast<float>(kQueryLeastDirection)), skew(kQueryBoxSkew), pad(ray.pad);
  std::uint32_t out = 0;
  for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>) {
    const BoxLanes<V> box = load_box<V>(boxes, lane);
    const Vec3<V> to = box.center - at;
    const V grow = pad + skew * (box.half.x + box.half.y + box.half.z);
    const V halves[3] = {box.half.x + grow, box.half.y + grow, box.half.z + grow};
    V near(ray.begin), far(ray.end);
    for (int k = 0; k < 3; ++k) {
      const V way = dot(box.axis[k], to), speed = dot(box.axis[k], direction);
      const V inverse = divide(V(1.0f), select(abs(speed) < least, least, speed));
      const V lo = (way - halves[k]) * inverse, hi = (way + halves[k]) * inverse;
      near = max(near, min(lo, hi));
      far = min(far, max(lo, hi));
    }
    Lanes<V>::store(entry + lane, near);
    out |= (~bits(near > far) & ((1u << kWidth<V>)-1)) << lane;
  }
  return out;
}

// Writes the square of the distance of a point from each box, whose root is off by at most what step 12.8 says.
template <class V>
void point_boxes(const BoxTile& boxes, const float (&point)[3], float* distance_sq) {
  const Vec3<V> at = {V(point[0]), V(point[1]), V(point[2])};
  for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>) {
    const BoxLanes<V> box = load_box<V>(boxes, lane);
    const Vec3<V> to = at - box.center;
    const V x = max(V(0.0f), abs(dot(box.axis[0], to)) - box.half.x);
    const V y = max(V(0.0f), abs(dot(box.axis[1], to)) - box.half.y);
    const V z = max(V(0.0f), abs(dot(box.axis[2], to)) - box.half.z);
    Lanes<V>::store(distance_sq + lane, x * x + y * y + z * z);
  }
}

}  // namespace cab::kernel
