// A ray, or a sphere that is moved along it, near the triangles of one leaf.
#pragma once

#include "engine/exact/surface.h"
#include "kernels/surface/ray_triangles.h"

namespace cab {

// A ray near an instance, in the world's axes, relative to the instance's origin. Its points are at + t direction.
struct LocalRay {
  Double3 at;         // where t = 0: best the ray's point that is nearest to the instance's origin
  Double3 direction;  // of length 1, to rounding
  double begin, end;  // the range of t: begin is finite and at most `end`, which may be infinite
  double radius;      // of the sphere, 0 or more; 0 for a ray
  double error;       // how far rounding may have moved the sphere at any t in the range, 0 or more
};

// A direction of length 1 across another.
Double3 across(const Double3& v);

// The ray in float, near the triangles of a skinned leaf (docs/proof.md, step 21.5).
kernel::SurfaceRay surface_ray(const ExactLeaf& leaf, const kernel::SkinnedLeaf& skin, const LocalRay& ray);

}  // namespace cab
