// Bodies about points: one shape of each kind, and what is inside of it.
#pragma once

#include <cab/types.h>

#include <cstdint>
#include <vector>

#include "scenes/rig/hull.h"
#include "scenes/vec3d.h"

namespace cab::scenes {

// What covers the rounding of a body's numbers to float, as a share of its size.
inline constexpr double kMargin = 0x1p-20;

// A body in its link's frame: a convex part, or a box if it has no part.
struct Solid {
  Box box = {};
  bool has_part = false;
  ConvexPart part;              // without its vertices
  std::vector<float> vertices;  // of a hull
  Hull hull;                    // of a hull
  double volume = 0;            // 0 of a flat box
  double box_volume = 0;
  Vec3 centre = {0, 0, 0};  // of a ball about the body
  double radius = 0;
};

// Whether no coordinate of points is beyond kMaxCoordinate.
bool are_in_range(const std::vector<Vec3>& points);

// The solid of the least volume among some kinds (rig::BodyKind) that contains all points, which are in range, and of
// which there is at least one. Points in one plane get a flat box. Each solid is kMargin larger than it must be, so it
// may be out of range.
// Throws std::bad_alloc.
Solid fit_solid(const std::vector<Vec3>& points, std::uint32_t kinds, std::size_t max_hull_vertices);

// Whether a point of the link's frame is in a solid, or outside by at most kMargin of the solid's size.
bool is_inside(const Solid& solid, const Vec3& point);

// How far a point is from a solid, 0 if it is inside. For ellipsoids it is an upper limit.
double distance(const Solid& solid, const Vec3& point);

}  // namespace cab::scenes
