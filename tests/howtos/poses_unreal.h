// Poses of Unreal: component-space transforms, as floats where they lie, as doubles copied into 7 floats or 16.
#pragma once

#include <cab/cab.h>

#include <vector>

namespace as_in_unreal {

// Like FTransform of Unreal 5, in doubles: the quaternion is x y z w; the fourth numbers of the others are not used.
struct alignas(32) Transform {
  double rotation[4], translation[4], scale[4];
};

// Like FTransform3f, and FTransform of Unreal 4.
struct alignas(16) Transform3f {
  float rotation[4], translation[4], scale[4];
};

// Like FMatrix44f: M[row][column]. A point is a row in front of it, so the axes and the translation are its rows. Rows
// of Unreal are columns of cab: the bytes are the same, and nothing is transposed.
struct Matrix44f {
  float M[4][4];
};

// quote
// Component-space transforms in floats, all of scale 1: 7 of their floats are a pose. No number is copied.
inline cab::PoseView poses_of(const Transform3f* transforms) {
  cab::PoseView poses;
  poses.format = cab::PoseFormat::kQuaternionTranslation;
  poses.data = transforms->rotation;
  poses.link_stride = sizeof(Transform3f);
  return poses;
}

// Component-space matrices in floats, scales included.
inline cab::PoseView poses_of(const Matrix44f* matrices) {
  cab::PoseView poses;
  poses.format = cab::PoseFormat::kMatrix4x4Columns;
  poses.data = matrices->M[0];
  poses.has_scale = true;
  return poses;
}

// Component-space transforms in doubles, all of scale 1, become 7 floats each.
inline void append_poses(const Transform* transforms, std::size_t count, std::vector<float>* poses) {
  for (std::size_t i = 0; i < count; ++i) {
    for (int k = 0; k < 4; ++k) poses->push_back(static_cast<float>(transforms[i].rotation[k]));
    for (int k = 0; k < 3; ++k) poses->push_back(static_cast<float>(transforms[i].translation[k]));
  }
}
// end quote

}  // namespace as_in_unreal
