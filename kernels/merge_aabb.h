// Axis-aligned bounds: of a box, and of two bounds (the paper's AABB*). A merge of bounds rounds nothing and needs no
// padding.
#pragma once

#include "kernels/box.h"
#include "layout/error_bounds.h"

namespace cab::kernel {

template <class V>
struct AabbLanes {
  Vec3<V> lo, hi;
};

template <class V>
CAB_INLINE AabbLanes<V> load_aabb(const AabbTile& tile, std::uint32_t lane) {
  return {load3<V>(tile.lo, lane), load3<V>(tile.hi, lane)};
}

template <class V>
CAB_INLINE void store_aabb(AabbTile& tile, std::uint32_t lane, const AabbLanes<V>& box) {
  store3(tile.lo, lane, box.lo);
  store3(tile.hi, lane, box.hi);
}

// Bounds of an oriented box. They are wide enough to contain it. They also overlap the bounds of every box that no
// world axis of the leaf predicate separates from it.
template <class V>
CAB_INLINE AabbLanes<V> bounds_of(const BoxLanes<V>& box) {
  const V pad = V(kBoundsPad) * (sum(box.half) + max_component(abs(box.center)) + V(kOverlapTiny));
  const Vec3<V> reached = world_half_extents(box);
  const Vec3<V> out = {reached.x + pad, reached.y + pad, reached.z + pad};
  return {box.center - out, box.center + out};
}

template <class V>
CAB_INLINE AabbLanes<V> merge_aabb(const AabbLanes<V>& a, const AabbLanes<V>& b) {
  return {min(a.lo, b.lo), max(a.hi, b.hi)};
}

}  // namespace cab::kernel
