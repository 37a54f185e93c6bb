// A ray, or a sphere that is moved along it, against one posed box, convex shape or triangle, in double.
#pragma once

#include "engine/exact/surface_ray.h"

namespace cab {

// Where a ray touches a shape, relative to the instance's origin, in the world's axes.
struct RayTouch {
  double at;       // the t where the sphere first touches
  Double3 point;   // of the shape; if `inside` the sphere's centre at `begin`
  Double3 normal;  // of length 1, of a plane that leaves the shape behind it and enters no later; 0 if `inside`
  bool inside;     // whether the sphere touches at `begin` already
};

// Whether the sphere touches the box, the shape or the triangle in the range, and where first. *out is written only if
// it does.
//
// No touch is lost. If the true sphere touches the true shape at a t in the range, then the answer is yes, and out->at
// is at most the first such t, but for a rounding of it to double. The true sphere is at most ray.error away. The true
// shape is the one that the floats give: a box with axes that may be a little skew, or the shape posed without rounding
// and its matrix made orthonormal. The true triangle is off by kSurfaceErrorDouble of its size (step 21.3).
//
// A touch is a touch of the shape grown by kRayGrowth times the slack of docs/proof.md, step 11.1: out->at is at least
// the first t at which the sphere touches that, again but for rounding. Only a sphere much smaller than a hull that is
// thinner than 1e-3 may be reported earlier (step 11.4).
//
// The pose must have passed is_valid, and numbers of the box must be finite. Nothing is allocated.
bool cast_ray(const LocalRay& ray, const BoxAos& box, RayTouch* out);
bool cast_ray(const LocalRay& ray, const ConvexShape& shape, const StoredPose& at, RayTouch* out);
bool cast_ray(const LocalRay& ray, const PlacedTriangle& triangle, RayTouch* out);

// Writes the weights of the corners that give a triangle's point nearest to another: 0 to 1, and they add to 1.
void weigh_corners(const PlacedTriangle& triangle, const Double3& point, double (&weights)[3]);

// The slack that the answers above have, for tests: of a box, and of a shape in its pose.
double ray_slack(const LocalRay& ray, const BoxAos& box);
double ray_slack(const LocalRay& ray, const ConvexShape& shape, const StoredPose& at);
double ray_slack(const LocalRay& ray, const PlacedTriangle& triangle);

}  // namespace cab
