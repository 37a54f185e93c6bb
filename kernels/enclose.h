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

// The box along given axes around a first box and all that are added. Projects from the first box's centre, never from
// the origin: far from it that would cost 40 times the rounding. axes are orthonormal to 16 u; the result is padded to
// contain every box whatever was rounded.
template <class V>
class Enclosure {
 public:
  CAB_INLINE Enclosure(const BoxLanes<V>& first, const Vec3<V> (&axes)[3])
      : center_(first.center), axes_{axes[0], axes[1], axes[2]} {
    hi_ = {reach_along(first, axes[0]), reach_along(first, axes[1]), reach_along(first, axes[2])};
    lo_ = {-hi_.x, -hi_.y, -hi_.z};
  }

  CAB_INLINE void add(const BoxLanes<V>& box) {
    const Vec3<V> between = box.center - center_;
    widen(box, between, axes_[0], lo_.x, hi_.x);
    widen(box, between, axes_[1], lo_.y, hi_.y);
    widen(box, between, axes_[2], lo_.z, hi_.z);
  }

  // The order of the sum matters far out: the middle is formed first and added to the first centre once.
  CAB_INLINE BoxLanes<V> box() const {
    const V half(0.5f);
    const Vec3<V> middle = half * (hi_ + lo_);
    const Vec3<V> size = half * (hi_ - lo_);
    const Vec3<V> center = center_ + (middle.x * axes_[0] + middle.y * axes_[1] + middle.z * axes_[2]);
    const V pad = V(kMergePadSize) * sum(size) + V(kMergePadPlace) * max_component(abs(center)) + V(kMergePadTiny);
    return {center, {axes_[0], axes_[1], axes_[2]}, {size.x + pad, size.y + pad, size.z + pad}};
  }

 private:
  static CAB_INLINE void widen(const BoxLanes<V>& box, Vec3<V> between, Vec3<V> direction, V& lo, V& hi) {
    const V reached = reach_along(box, direction);
    const V offset = dot(between, direction);
    hi = max(hi, offset + reached);
    lo = min(lo, offset - reached);
  }

  Vec3<V> center_;
  Vec3<V> axes_[3];
  Vec3<V> lo_, hi_;
};

template <class V>
CAB_INLINE BoxLanes<V> enclose(const BoxLanes<V>& first, const BoxLanes<V>& second, const Vec3<V> (&axes)[3]) {
  Enclosure<V> out(first, axes);
  out.add(second);
  return out.box();
}

}  // namespace cab::kernel
