// The vertices of convex hulls for exact tests: those inside a hull are left out, by qhull.
#pragma once

#include <cab/span.h>

#include <vector>

namespace cab {

// Returns the vertices (x y z each) without those that are inside their hull, in their order. Returns all of them if
// qhull fails. Opens no file.
std::vector<float> hull_vertices(Span<const float> vertices);

}  // namespace cab
