// Robots from URDF.
#pragma once

#include "scenes/import/in_child.h"
#include "scenes/robot/robot.h"
#include "scenes/robot/xml_text.h"

#include <map>
#include <string>
#include <vector>

namespace cab::scenes {

// The mesh files of collision shapes, by their names in the robot's file: those that are there.
using MeshFiles = std::map<std::string, std::string>;

// Finds the meshes of a text whose first element is <robot>. `package_files` are those of scenes/robot/packages.h.
MeshFiles find_meshes(const XmlText& text, const RobotOptions& options, const std::vector<std::string>& package_files);

// Reads a robot from such a text. `current` is set to each mesh file while it is read, and `triangles` gets those of
// each leaf, unless these are null. Throws ImportError.
Robot read_urdf(const XmlText& text, const RobotOptions& options, const MeshFiles& meshes, CurrentFile* current,
                LeafTriangles* triangles);

}  // namespace cab::scenes
