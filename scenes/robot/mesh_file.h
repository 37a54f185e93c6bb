// Vertices of mesh files, and where a robot's file says they are.
#pragma once

#include "scenes/robot/packages.h"
#include "scenes/robot/robot.h"

#include <optional>
#include <string>
#include <vector>

namespace cab::scenes {

// Finds the mesh files that a URDF file names.
class MeshFinder {
 public:
  // `robot_path` is the URDF file. `package_files` are those of scenes/robot/packages.h; they are read when a mesh is
  // not found without them.
  MeshFinder(const std::string& robot_path, const RobotOptions& options, const std::vector<std::string>& package_files)
      : robot_path_(robot_path), options_(options), package_files_(package_files) {}

  // The file that a name means, or an empty path if there is none.
  std::string find(const std::string& name);

 private:
  std::string find_in_package(const std::string& name_and_rest);

  const std::string& robot_path_;
  const RobotOptions& options_;
  const std::vector<std::string>& package_files_;
  std::optional<PackageFolders> packages_;
};

// Throws ImportError with `source` for a name of a mesh that is no path, such as http://.
void check_mesh_name(const std::string& name, const std::string& source);

// Whether a path ends as that of a mesh file that is read.
bool is_mesh_path(const std::string& path);

// All vertices of a mesh file, in metres of the file, each once. The axes are those of the file: no turn by an up axis.
// `notes` gets what of the file is read otherwise than a user may expect, with `source`. Throws ImportError with
// `source`. `corners` (may be null) gets the three corners of each triangle; polygons are cut into triangles.
std::vector<Vec3> read_mesh(const std::string& path, const std::string& source, std::vector<std::string>& notes,
                            std::vector<Vec3>* corners = nullptr);

}  // namespace cab::scenes
