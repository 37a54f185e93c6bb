// Robots from MJCF.
#pragma once

#include "scenes/robot/robot.h"
#include "scenes/robot/xml_text.h"

namespace cab::scenes {

// Reads a robot from a text whose first element is <mujoco>. `triangles` (may be null) gets those of each leaf. Throws
// ImportError, also if libmujoco is not built in.
Robot read_mjcf(const XmlText& text, const RobotOptions& options, LeafTriangles* triangles);

}  // namespace cab::scenes
