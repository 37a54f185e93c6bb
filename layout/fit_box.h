// The oriented box about the vertices of a mesh, fitted once.
#pragma once

#include <cab/types.h>

namespace cab {

// What the public fit_box does, for a caller that has set the floating-point mode. Throws std::bad_alloc.
Status fit_box_to_vertices(Span<const float> vertices, Box* out);

}  // namespace cab
