// Poses of ROS: transforms of tf and the boxes of URDF, in metres.
#pragma once

#include <cab/cab.h>

#include <cmath>
#include <vector>

namespace as_in_ros {

// Like geometry_msgs/Transform: doubles, the translation first, and the quaternion is x y z w.
struct Transform {
  double translation[3];
  double rotation[4];
};

// quote
// The pose of a link: what lookupTransform(base, link) answers, with the robot's base as the target frame.
inline void append_pose(const Transform& link_to_base, std::vector<float>* poses) {
  for (const double x : link_to_base.rotation) poses->push_back(static_cast<float>(x));
  for (const double x : link_to_base.translation) poses->push_back(static_cast<float>(x));
}

// Matrices of NumPy, link to base: float32, four rows of four. The first three rows are a pose. No number is copied.
inline cab::PoseView poses_of_rows(const float* matrices) {
  cab::PoseView poses;
  poses.format = cab::PoseFormat::kMatrix3x4Rows;
  poses.data = matrices;
  poses.link_stride = 16 * sizeof(float);
  return poses;
}

// Where the robot stands: what lookupTransform(map, base) answers. The place stays in double.
inline void append_place(const Transform& base_to_map, std::vector<double>* origins, std::vector<float>* orientations) {
  for (const double x : base_to_map.translation) origins->push_back(x);
  for (const double x : base_to_map.rotation) orientations->push_back(static_cast<float>(x));
}
// end quote

// A box of URDF, <origin xyz rpy> and <box size>: rotated about the fixed axes x, y, z by roll, pitch, yaw, in this
// order. A size is a whole length, cab's is a half.
inline cab::Box box_of(const double (&xyz)[3], const double (&rpy)[3], const double (&size)[3]) {
  const double sr = std::sin(rpy[0]), cr = std::cos(rpy[0]), sp = std::sin(rpy[1]), cp = std::cos(rpy[1]);
  const double sy = std::sin(rpy[2]), cy = std::cos(rpy[2]);
  const double axis[3][3] = {{cy * cp, sy * cp, -sp},
                             {cy * sp * sr - sy * cr, sy * sp * sr + cy * cr, cp * sr},
                             {cy * sp * cr + sy * sr, sy * sp * cr - cy * sr, cp * cr}};
  cab::Box box;
  for (int k = 0; k < 3; ++k) {
    box.center[k] = static_cast<float>(xyz[k]);
    box.half[k] = static_cast<float>(size[k] / 2);
    for (int i = 0; i < 3; ++i) box.axis[k][i] = static_cast<float>(axis[k][i]);
  }
  return box;
}

}  // namespace as_in_ros
