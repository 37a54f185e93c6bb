// The leaf box about a link's convex parts.
#pragma once

#include <cab/types.h>

#include <vector>

namespace cab::scenes {

// The smallest box about all parts. There is at least one part, and none is a hull or a half space. The orientations to
// choose from are those of the parts, of at most 256 of them, and those of the planes that pairs of parts span, so the
// time is linear in the parts. The box is computed in double and rounded outwards, so it contains the parts with their
// float sizes, rotations and positions. For one part the box is aligned with it.
Box leaf_box(const std::vector<ConvexPart>& parts);

}  // namespace cab::scenes
