#include "engine/queries/surface_rays.h"

#include "engine/exact/surface.h"

#include <algorithm>

namespace cab {

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
