// Robots from URDF.
#pragma once

#include "scenes/robot/robot.h"
#include "scenes/robot/xml_text.h"

namespace cab::scenes {

// Reads a robot from a text whose first element is <robot>. Throws ImportError.
Robot read_urdf(const XmlText& text, const RobotOptions& options);

}  // namespace cab::scenes
