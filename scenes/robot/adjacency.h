// Which links of a robot have shapes, and which of those a joint connects.
#pragma once

#include "scenes/robot/robot.h"

#include <vector>

namespace cab::scenes {

// Whether each link has a shape.
std::vector<bool> shaped_links(const Robot& robot);

// The pairs of links with shapes that a joint connects. Links without shapes pass a connection on, so all links about
// one of them are connected. A link that floats is not connected to its parent.
std::vector<LinkPair> adjacent_pairs(const Robot& robot);

}  // namespace cab::scenes
