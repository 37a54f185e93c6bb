// Robots from URDF.
#pragma once

#include "scenes/import/in_child.h"
#include "scenes/robot/robot.h"
#include "scenes/robot/xml_text.h"

#include <string>
#include <vector>

namespace cab::scenes {

// Reads a robot from a text whose first element is <robot>. `current` is set to each mesh file while it is read, unless
// it is null. Throws ImportError.
Robot read_urdf(const XmlText& text, const RobotOptions& options, CurrentFile* current);

// The mesh files of the collision shapes of such a text, each once: those that are there.
std::vector<std::string> mesh_files(const XmlText& text, const RobotOptions& options);

}  // namespace cab::scenes
