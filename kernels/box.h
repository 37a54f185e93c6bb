// An oriented box in registers, one box per lane.
#pragma once

#include "kernels/vec3.h"

namespace cab::kernel {

template <class V>
struct BoxLanes {
  Vec3<V> center;
  Vec3<V> axis[3];
  Vec3<V> half;
};

template <class V>
CAB_INLINE BoxLanes<V> load_box(const BoxTile& tile, std::uint32_t lane) {
  return {load3<V>(tile.center, lane),
          {load3<V>(tile.axis[0], lane), load3<V>(tile.axis[1], lane), load3<V>(tile.axis[2], lane)},
          load3<V>(tile.half, lane)};
}

template <class V>
CAB_INLINE void store_box(BoxTile& tile, std::uint32_t lane, const BoxLanes<V>& box) {
  store3(tile.center, lane, box.center);
  for (int k = 0; k < 3; ++k) store3(tile.axis[k], lane, box.axis[k]);
  store3(tile.half, lane, box.half);
}

// The projected radius of a box along each world axis: how far it extends from its centre.
template <class V>
CAB_INLINE Vec3<V> world_half_extents(const BoxLanes<V>& box) {
  return box.half.x * abs(box.axis[0]) + box.half.y * abs(box.axis[1]) + box.half.z * abs(box.axis[2]);
}

// A box in every lane.
template <class V>
CAB_INLINE BoxLanes<V> spread_box(const Box& box) {
  const auto vector = [](const float* p) { return Vec3<V>{V(p[0]), V(p[1]), V(p[2])}; };
  return {vector(box.center), {vector(box.axis[0]), vector(box.axis[1]), vector(box.axis[2])}, vector(box.half)};
}

}  // namespace cab::kernel
