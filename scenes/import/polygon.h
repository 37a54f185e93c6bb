// Triangles of a mesh's polygons.
#pragma once

#include "scenes/vec3d.h"

#include <cstdint>
#include <vector>

namespace cab::scenes {

// Adds the triangles of a polygon to `triangles`: the numbers of three corners each, two triangles fewer than corners,
// which turn as the polygon does. A convex polygon becomes a fan about its first corner. Another one is cut along
// diagonals that are inside it; a rest that has none, as it crosses itself or has no area, becomes a fan, and so does a
// polygon of more than 4096 corners. The triangles always cover the polygon, and of a simple one that was cut nothing
// else but for rounding.
void cut_polygon(const std::vector<Vec3>& polygon, std::vector<std::uint32_t>& triangles);

}  // namespace cab::scenes
