#include "engine/exact/surface_ray.h"

#include "layout/error_bounds.h"
#include "layout/rounded_up.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace cab {
namespace {

void set_axis(const Double3& v, float (&out)[3]) {
  out[0] = static_cast<float>(v.x);
  out[1] = static_cast<float>(v.y);
  out[2] = static_cast<float>(v.z);
}

}  // namespace

Double3 across(const Double3& v) {
  const Double3 size = kernel::abs(v);
  const Double3 least = size.x <= size.y && size.x <= size.z ? Double3{1, 0, 0}
                        : size.y <= size.z                   ? Double3{0, 1, 0}
                                                             : Double3{0, 0, 1};
  return kernel::normalized(kernel::cross(v, least));
}

kernel::SurfaceRay surface_ray(const ExactLeaf& leaf, const kernel::SkinnedLeaf& skin, const LocalRay& ray) {
  const SurfaceLeaves& surface = leaf.batch->articulation->surface;
  kernel::SurfaceRay out = {skin, patches_of(leaf), surface.leaves[leaf.leaf].patch_count, {}, {}, {}, 0};
  const auto size = static_cast<double>(skin.size);
  const double lengths = kernel::sum(kernel::abs(ray.at)) + size + ray.radius;
  const double pad = ray.radius + ray.error + 2 * static_cast<double>(kSurfaceError) * size + kQueryBoxPad * lengths;
  out.pad = float_above(pad) + 4 * std::numeric_limits<float>::min();
  const Double3 x = across(ray.direction);
  set_axis(ray.at, out.at);
  set_axis(ray.direction, out.axis[0]);
  set_axis(x, out.axis[1]);
  set_axis(kernel::cross(ray.direction, x), out.axis[2]);
  const double at[3] = {ray.at.x, ray.at.y, ray.at.z}, along[3] = {ray.direction.x, ray.direction.y, ray.direction.z};
  for (int c = 0; c < 3; ++c) {
    out.lanes.above[c] = float_above(at[c] + static_cast<double>(out.pad));
    out.lanes.below[c] = float_below(at[c] - static_cast<double>(out.pad));
    const double speed = std::max(std::fabs(along[c]), kQueryLeastDirection);
    out.lanes.inverse[c] = static_cast<float>(1 / (along[c] < 0 ? -speed : speed));
  }
  out.lanes.begin = float_below(ray.begin);
  out.lanes.end = float_above(ray.end);
  return out;
}

}  // namespace cab
