// Lists the triangles of leaves, and the vertices and weights that place them (layout/surface_leaves.h).
#pragma once

#include "layout/arena.h"
#include "layout/surface_leaves.h"

namespace cab {

// Lists what leaves have of a skin that fit_skin has checked. Throws std::bad_alloc.
void list_surface(const ArticulationDesc& desc, Arena& arena, SurfaceLeaves& out);

}  // namespace cab
