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
};

// Whether no number of a vector, or of a motion, is beyond kMaxImportValue or no number.
bool in_range(const Vec3& vector);
bool in_range(const RigidMotion& motion);

// Adds a leaf with the shape to a link. `source` says where the shape is written, for messages. Throws ImportError for
// sizes, places and vertices that are not numbers or are out of range, and for sizes that are not above 0.
void add_shape(Robot& robot, std::uint32_t link, const RobotShape& shape, const std::string& source);

}  // namespace cab::scenes
