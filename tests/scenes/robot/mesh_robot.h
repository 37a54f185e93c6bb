// A robot of meshes in files of their own.
#pragma once

#include "tests/scenes/temporary_file.h"

#include <fstream>
#include <string>

namespace cab::tests {

// A grid of 2 n^2 triangles over the unit square, as OBJ.
inline std::string grid(int n) {
  std::string text;
  for (int y = 0; y <= n; ++y)
    for (int x = 0; x <= n; ++x)
      text += "v " + std::to_string(static_cast<double>(x) / n) + " " + std::to_string(static_cast<double>(y) / n) +
              " " + std::to_string(0.1 * (x * y % 3)) + "\n";
  for (int y = 0; y < n; ++y)
    for (int x = 0; x < n; ++x) {
      const int at = y * (n + 1) + x + 1;
      text += "f " + std::to_string(at) + " " + std::to_string(at + 1) + " " + std::to_string(at + n + 1) + "\nf " +
              std::to_string(at + 1) + " " + std::to_string(at + n + 2) + " " + std::to_string(at + n + 1) + "\n";
    }
  return text;
}

inline std::string mesh(const std::string& file, const std::string& more) {
  return "<collision>" + more + "<geometry><mesh filename='" + file + "'/></geometry></collision>";
}

inline void write_beside(const TemporaryFile& file, const std::string& name, const std::string& text) {
  std::ofstream(file.directory() / name) << text;
}

// base: a box and two grids, one of them mirrored. bare: no shape. arm: a grid, and a mesh whose triangles are lines.
struct MeshRobot {
  TemporaryFile urdf = {
      "r.urdf", "<robot name='r'><link name='base'><collision><geometry><box size='1 2 3'/></geometry></collision>" +
                    mesh("grid.obj", "<origin xyz='1 2 3' rpy='.1 .2 .3'/>") +
                    "<collision><geometry><mesh filename='grid.obj' scale='-2 1 3'/></geometry></collision></link>"
                    "<link name='bare'/><link name='arm'>" +
                    mesh("lines.obj", "") + mesh("grid.obj", "") + "</link>" + joint("base", "bare") +
                    joint("bare", "arm") + "</robot>"};
  std::string file = urdf.path();

  MeshRobot() {
    write_beside(urdf, "grid.obj", grid(12));
    write_beside(urdf, "lines.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 1\nf 3 4 4\n");
  }

  static std::string joint(const std::string& parent, const std::string& child) {
    return "<joint name='" + child + "_joint' type='continuous'><parent link='" + parent + "'/><child link='" + child +
           "'/></joint>";
  }
};

}  // namespace cab::tests
