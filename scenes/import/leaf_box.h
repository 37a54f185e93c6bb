// The leaf box about a link's ellipsoids.
#pragma once

#include "scenes/scene.h"

#include <vector>

namespace cab::scenes {

// The smallest box about all parts, which are ellipsoids, at least one. The orientations to choose from are those of
// the parts and those of the planes that pairs of parts span. Computed in double and rounded outwards, so that the box
// contains the parts with their float sizes, rotations and positions. For one part the box is aligned with it.
Box leaf_box(const std::vector<ShapePart>& parts);

}  // namespace cab::scenes
