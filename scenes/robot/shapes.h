// Collision shapes of a robot's links as leaves.
#pragma once

#include "scenes/robot/robot.h"

namespace cab::scenes {

// One collision shape in the frame of its link.
struct RobotShape {
  ShapeKind kind = ShapeKind::kBox;
  RigidMotion place;           // of the shape in the link's frame
  Vec3 size = {0, 0, 0};       // metres, as in ConvexPart::size
  std::vector<Vec3> vertices;  // of a hull, in the shape's frame, metres
  std::vector<Vec3> corners;   // of the triangles of a mesh, likewise; not read by add_shape
};

// Whether no number of a vector, or of a motion, is beyond kMaxImportValue or no number.
bool in_range(const Vec3& vector);
bool in_range(const RigidMotion& motion);

// Notes a shape without volume, which stands for a point or holds a place: no leaf is made of it.
void leave_out_empty(Robot& robot, const std::string& source);

// Adds a leaf with the shape to a link, or leaves it out if a size is 0. `source` says where the shape is written, for
// messages. Throws ImportError for sizes, places and vertices that are not numbers or are out of range, and for sizes
// below 0.
void add_shape(Robot& robot, std::uint32_t link, const RobotShape& shape, const std::string& source);

// Adds the corners of a shape that became a leaf to `triangles`, if that is not null.
void add_triangles(const RobotShape& shape, LeafTriangles* triangles);

}  // namespace cab::scenes
