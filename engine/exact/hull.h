// The vertices of convex hulls for exact tests: those inside a hull are left out, by qhull. A library without qhull is
// built with hull_absent.cpp instead of hull.cpp.
#pragma once

#include <cab/span.h>

#include <vector>

namespace cab {

// Returns the vertices (x y z each) without those that are inside their hull, in their order. Returns all of them if
// qhull fails or is absent. Opens no file.
std::vector<float> hull_vertices(Span<const float> vertices);

// Whether qhull is built in.
bool has_qhull();

}  // namespace cab
