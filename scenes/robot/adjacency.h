// Which links of a robot have shapes, and which of those are adjacent: tests between them say nothing.
#pragma once

#include "scenes/robot/robot.h"

#include <vector>

namespace cab::scenes {

// Whether each link has a shape.
std::vector<bool> shaped_links(const Robot& robot);

// The adjacent pairs of links with shapes, each with the lower index first, sorted.
//
// Links that are welded to each other, directly or over others, are one rigid body and adjacent. So are links that a
// joint connects. Links without shapes pass the connection on while at most one joint that moves lies between the two
// links. The first link passes nothing on: without a shape it stands for the world. A link that floats is not connected
// to its parent.
std::vector<LinkPair> adjacent_pairs(const Robot& robot);

}  // namespace cab::scenes
