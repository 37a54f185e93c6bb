// Rays at the index that they are searched in: their directions, and where they enter it.
#pragma once

#include "kernels/query_bounds.h"
#include "kernels/vec3.h"
#include "layout/error_bounds.h"

#include <cstddef>

namespace cab::kernel {

// Rays as a query gives them, and what follows, as lanes of doubles.
template <class D>
struct EnteringRay {
  Vec3<D> from, direction;  // of any length
  D length, radius;
  Vec3<D> along;    // of length 1
  Vec3<D> inverse;  // one over each component of that, none of which counts as 0
  Mask<D> misses;   // whether the ray passes by the cube of the index
  D entered;        // the parameter at which it does, in the index's scale
  D end;            // how far it goes from there
  Vec3<D> start;    // where that is
  D pad;            // the radius and what rounding may move
};

// Sets the direction of length 1. A direction of 0, of a ray of length 0, is along x.
template <class D>
CAB_INLINE void aim(EnteringRay<D>& ray) {
  const D most = max_component(abs(ray.direction)), least(kQueryLeastDirection), zero(0.0);
  const Mask<D> is_given = most > zero;
  const D by = select(is_given, most, D(1.0));
  const Vec3<D> d = {divide(ray.direction.x, by), divide(ray.direction.y, by), divide(ray.direction.z, by)};
  ray.along = normalized(choose(is_given, d, Vec3<D>{D(1.0), zero, zero}));
  const auto inverse_of = [&](const D& x) {
    const D size = max(abs(x), least);
    return divide(D(1.0), select(x < zero, zero - size, size));
  };
  ray.inverse = {inverse_of(ray.along.x), inverse_of(ray.along.y), inverse_of(ray.along.z)};
}

// Moves the start to where the ray enters the cube of an index (docs/proof.md, step 12.2), whose centre and scale are
// given.
template <class D>
CAB_INLINE void enter_index(const Vec3<D>& center, const D& by, EnteringRay<D>& ray) {
  const D zero(0.0);
  const Vec3<D> from = by * (ray.from - center);
  const D radius = by * ray.radius, away = sum(abs(from));
  const D half = (D(1.01) + radius) + D(4 * kQueryLeastDirection) * away;
  D near(0.0), far = by * ray.length;
  const auto cut = [&](const D& at, const D& inverse) {
    const D x = (zero - half - at) * inverse, y = (half - at) * inverse;
    near = max(near, min(x, y));
    far = min(far, max(x, y));
  };
  cut(from.x, ray.inverse.x);
  cut(from.y, ray.inverse.y);
  cut(from.z, ray.inverse.z);
  ray.misses = near > far;
  ray.entered = near;
  ray.end = (far - near) + D(kQueryPad);
  ray.start = from + near * ray.along;
  ray.pad = radius + (D(2 * kQueryRayPad) * (D(1.0) + radius) + D(kQueryRounding) * (away + near));
}

// Sixteen rays of queries, each at an index of its own.
struct RayTile {
  alignas(64) double center[3][kLanes], scale[kLanes];  // of the index
  alignas(64) double position[3][kLanes], direction[3][kLanes], length[kLanes], radius[kLanes];

  // Receive what EnteringRay and RayLanes have.
  alignas(64) double along[3][kLanes], entered[kLanes];
  alignas(64) float above[3][kLanes], below[3][kLanes], inverse[3][kLanes], end[kLanes];
  std::uint32_t enters;  // bits of the lanes
};

template <class V>
void enter_rays(RayTile& tile) {
  using D = DoubleOf<V>;
  using L = Lanes<D>;
  tile.enters = 0;
  for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<D>) {
    const auto load = [&](const double(&from)[3][kLanes]) {
      return Vec3<D>{L::load(from[0] + lane), L::load(from[1] + lane), L::load(from[2] + lane)};
    };
    EnteringRay<D> ray;
    ray.from = load(tile.position);
    ray.direction = load(tile.direction);
    ray.length = L::load(tile.length + lane);
    ray.radius = L::load(tile.radius + lane);
    aim(ray);
    enter_index(load(tile.center), L::load(tile.scale + lane), ray);
    const auto store = [&](const Vec3<D>& v, auto(&to)[3][kLanes]) {
      L::store(to[0] + lane, v.x);
      L::store(to[1] + lane, v.y);
      L::store(to[2] + lane, v.z);
    };
    store(ray.along, tile.along);
    L::store(tile.entered + lane, ray.entered);
    store(ray.start + Vec3<D>{ray.pad, ray.pad, ray.pad}, tile.above);
    store(ray.start - Vec3<D>{ray.pad, ray.pad, ray.pad}, tile.below);
    store(ray.inverse, tile.inverse);
    L::store(tile.end + lane, ray.end + D(kOutwards) * abs(ray.end));
    tile.enters |= (~bits(ray.misses) & ((1u << kWidth<D>)-1)) << lane;
  }
}

}  // namespace cab::kernel
