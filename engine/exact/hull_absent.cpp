// The vertices of convex hulls in a library without qhull.
#include "engine/exact/hull.h"

namespace cab {

std::vector<float> hull_vertices(Span<const float> vertices) { return {vertices.begin(), vertices.end()}; }

bool has_qhull() { return false; }

}  // namespace cab
