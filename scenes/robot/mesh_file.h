// Vertices of mesh files, and where a robot's file says they are.
#pragma once

#include "scenes/robot/robot.h"

#include <string>
#include <vector>

namespace cab::scenes {

// The file that a name in a URDF file means, or an empty path if there is none. `robot_path` is the URDF file.
// Throws ImportError with `source` for a name that is no path, such as http://.
std::string find_mesh(const std::string& name, const std::string& robot_path, const RobotOptions& options,
                      const std::string& source);

// Whether a path ends as that of a mesh file that is read.
bool is_mesh_path(const std::string& path);

// All vertices of a mesh file, in metres of the file, each once. The axes are those of the file: no turn by an up axis.
// Throws ImportError with `source`.
std::vector<Vec3> read_mesh(const std::string& path, const std::string& source);

}  // namespace cab::scenes
