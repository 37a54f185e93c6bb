// The paper's Eq. 4: the box along given axes that contains two boxes.
#pragma once

#include "kernels/bounds.h"
#include "kernels/box.h"

namespace cab::kernel {

// How far a box reaches from its centre along a unit direction.
template <class V>
CAB_INLINE V reach_along(const BoxLanes<V>& box, Vec3<V> direction) {
  return box.half.x * abs(dot(box.axis[0], direction)) + box.half.y * abs(dot(box.axis[1], direction)) +
         box.half.z * abs(dot(box.axis[2], direction));
}

// Interval of both boxes along a direction, measured from the first box's centre.
template <class V>
CAB_INLINE void enclose_along(const BoxLanes<V>& first, const BoxLanes<V>& second, Vec3<V> between, Vec3<V> direction,
                              V& middle, V& half) {
  const V reach_1 = reach_along(first, direction);
  const V reach_2 = reach_along(second, direction);
  const V offset = dot(between, direction);
  const V hi = max(reach_1, offset + reach_2);
  const V lo = min(-reach_1, offset - reach_2);
  middle = V(0.5f) * (hi + lo);
  half = V(0.5f) * (hi - lo);
}

// Projects from the first box's centre, never from the origin: far from it that would cost 40 times the rounding.
// axes are orthonormal to 16 u; the result is padded to contain both boxes whatever was rounded.
template <class V>
CAB_INLINE BoxLanes<V> enclose(const BoxLanes<V>& first, const BoxLanes<V>& second, const Vec3<V> (&axes)[3]) {
  const Vec3<V> between = second.center - first.center;
  Vec3<V> middle, half;
  enclose_along(first, second, between, axes[0], middle.x, half.x);
  enclose_along(first, second, between, axes[1], middle.y, half.y);
  enclose_along(first, second, between, axes[2], middle.z, half.z);
  const Vec3<V> center = first.center + (middle.x * axes[0] + middle.y * axes[1] + middle.z * axes[2]);
  const V pad = V(kMergePadSize) * sum(half) + V(kMergePadPlace) * max_component(abs(center)) + V(kMergePadTiny);
  return {center, {axes[0], axes[1], axes[2]}, {half.x + pad, half.y + pad, half.z + pad}};
}

}  // namespace cab::kernel
