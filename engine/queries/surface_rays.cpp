#include "engine/queries/surface_rays.h"

#include "engine/exact/surface.h"
#include "kernels/surface/ray_triangles.h"
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

// A direction of length 1 across another.
Double3 across(const Double3& v) {
  const Double3 size = kernel::abs(v);
  const Double3 least = size.x <= size.y && size.x <= size.z ? Double3{1, 0, 0}
                        : size.y <= size.z                   ? Double3{0, 1, 0}
                                                             : Double3{0, 0, 1};
  return kernel::normalized(kernel::cross(v, least));
}

// The ray in float, near the triangles of a skinned leaf (docs/proof.md, step 21.5).
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

}  // namespace

bool cast_surface(const QueryRun& run, const ExactLeaf& leaf, const LocalRay& ray, SurfaceTouch* out) {
  QueryWorker& own = run.own;
  const kernel::SkinnedLeaf& skin =
      skinned(run.frame, leaf, nullptr, own.skins, {own.stats.leaves_skinned, own.stats.leaves_replaced});
  const kernel::SurfaceRay lanes = surface_ray(leaf, skin, ray);
  kernel::MetTriangle* const met = own.met_triangles.data;
  const std::uint32_t count = run.frame.kernels.ray_triangles(lanes, met);
  std::sort(met, met + count, [](const kernel::MetTriangle& a, const kernel::MetTriangle& b) {
    return a.entry != b.entry ? a.entry < b.entry : a.triangle < b.triangle;
  });
  bool touches = false;
  for (std::uint32_t i = 0; i < count; ++i) {
    const kernel::MetTriangle& one = met[i];
    if (touches && static_cast<double>(one.entry) > out->touch.at) break;
    RayTouch touch;
    if (!cast_ray(ray, triangle_in_double(leaf, one.triangle, {0, 0, 0}), &touch)) continue;
    if (touches && (touch.at > out->touch.at || (touch.at == out->touch.at && one.triangle > out->triangle))) continue;
    *out = {touch, one.triangle};
    touches = true;
  }
  return touches;
}

SurfacePoint surface_point(const ExactLeaf& leaf, const SurfaceTouch& touch) {
  SurfacePoint out;
  out.triangle = patches_of(leaf)[touch.triangle / kLanes].triangle[touch.triangle % kLanes];
  double weights[3];
  weigh_corners(triangle_in_double(leaf, touch.triangle, {0, 0, 0}), touch.touch.point, weights);
  for (int k = 0; k < 3; ++k) out.weights[k] = static_cast<float>(weights[k]);
  return out;
}

}  // namespace cab
