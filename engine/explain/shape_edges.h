// Lines that show the convex shapes of a leaf, for a debug draw.
#pragma once

#include "engine/exact/convex_pair.h"

#include <vector>

namespace cab {

struct Segment {
  Double3 from, to;
};

// Appends the lines of a shape, in its link's frame: the edges of boxes and hulls, circles and lengths of what is
// round. Returns false, and appends nothing, for a half space and for a hull whose edges are not known.
bool append_edges(const ConvexShape& shape, std::vector<Segment>& out);

}  // namespace cab
