// The leaf box about a link's ellipsoids.
#pragma once

#include "scenes/scene.h"

#include <vector>

namespace cab::scenes {

// The smallest box about all parts (ellipsoids only, at least one), among orientations taken from the parts' own axes
// and from the planes that pairs of parts span. Computed in double and rounded outwards: it contains the parts with
// their float sizes, rotations and positions. For one part the box is aligned to it.
Box leaf_box(const std::vector<ShapePart>& parts);

}  // namespace cab::scenes
