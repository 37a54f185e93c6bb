// The meshes of a robot as leaves of their triangles.
#pragma once

#include "scenes/robot/robot.h"

namespace cab::scenes {

// Takes the triangles of meshes in place of their hulls. The meshes of a link become leaves of some triangles each that
// are next to each other; other shapes stay as they are, and come first. triangles: of each leaf, as import_triangles
// has them. A mesh of no triangle with three different corners keeps its hull. Notes count triangles and parts, and
// name what stayed a hull. There are at most kMaxLeaves shapes, and at most so many leaves. Throws ImportError.
void take_surfaces(Robot& robot, const LeafTriangles& triangles);

}  // namespace cab::scenes
