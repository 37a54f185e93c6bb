// A robot's shapes as geometry of FCL, in double.
#pragma once

#include <fcl/common/types.h>
#include <fcl/geometry/collision_geometry.h>

#include <memory>
#include <vector>

#include <cab/types.h>

namespace cab::perf {

using RobotGeometry = std::shared_ptr<fcl::CollisionGeometryd>;

// The triangles of a mesh, nine numbers each, as a tree of boxes.
RobotGeometry mesh_geometry(const std::vector<float>& corners);

// A shape that is no mesh, about its own middle.
RobotGeometry shape_geometry(const ConvexPart& part);

// A quaternion x y z w of any length, and a translation.
fcl::Transform3d motion_of(const float* rotation, const float* translation);

// Where the geometry of a leaf is: a mesh is in the frame of its link, another shape in its own.
fcl::Transform3d place_of(bool is_mesh, const ConvexPart& part, const float* pose);

}  // namespace cab::perf
