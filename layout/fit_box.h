// The oriented box about the vertices of a mesh, fitted once.
#pragma once

#include <cab/types.h>

namespace cab {

// Does the work of the public fit_box, in the floating-point mode that the caller has set. Throws std::bad_alloc.
Status fit_box_to_vertices(Span<const float> vertices, Box* out);

}  // namespace cab
