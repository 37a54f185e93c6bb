// The meshes of a robot as several convex hulls each.
#pragma once

#include "scenes/robot/robot.h"

namespace cab::scenes {

// Cuts meshes where that saves volume, as rig::BodyRules::leaves_per_link says, into at most `most` hulls each, 1 to
// 64. Every triangle is wholly in one of its mesh's hulls; a piece whose triangles are in a plane becomes a flat box.
// A mesh of no triangle with three different corners keeps its hull. triangles: of each leaf, as import_triangles has
// them. A note counts. Throws ImportError.
void cut_meshes(Robot& robot, const LeafTriangles& triangles, std::uint32_t most);

}  // namespace cab::scenes
