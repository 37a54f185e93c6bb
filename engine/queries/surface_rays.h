// Rays, and spheres that are moved along them, against the triangles of one leaf.
#pragma once

#include "engine/queries/ray_cast.h"
#include "engine/queries/search.h"

namespace cab {

// A triangle that a ray touches, and where.
struct SurfaceTouch {
  RayTouch touch;
  std::uint32_t triangle;  // kLanes times its patch, and its lane
};

// Whether a ray touches the triangles of a leaf of the job's inputs, and which first, of equally near ones the lowest.
// *out is written only if it does. No touch is lost (cast_ray). The leaf is skinned if the worker has not kept it.
bool cast_surface(const QueryRun& run, const ExactLeaf& leaf, const LocalRay& ray, SurfaceTouch* out);

// What QueryJob::surface_points has of a touch.
SurfacePoint surface_point(const ExactLeaf& leaf, const SurfaceTouch& touch);

}  // namespace cab
