// Finds the connected parts of the triangles of leaves (layout/surface_parts.h).
#pragma once

#include "layout/arena.h"
#include "layout/surface_leaves.h"
#include "layout/surface_parts.h"

namespace cab {

// `surface` is what list_surface has listed of the description. Throws std::bad_alloc.
void find_parts(const ArticulationDesc& desc, const SurfaceLeaves& surface, Arena& arena, SurfaceParts& out);

}  // namespace cab
