// Poses of Unity: matrices of transforms, or rigid transforms of jobs, handed over as they are.
#pragma once

#include <cab/cab.h>

namespace as_in_unity {

// Like UnityEngine.Matrix4x4, whose fields are in this order: by columns. float4x4 of Unity.Mathematics has the same
// bytes.
struct Matrix4x4 {
  float m00, m10, m20, m30, m01, m11, m21, m31, m02, m12, m22, m32, m03, m13, m23, m33;
};

// Like Unity.Mathematics.RigidTransform: rot.value is x y z w.
struct RigidTransform {
  float rot[4];
  float pos[3];
};

// quote
// Matrix4x4.TRS(root.position, root.rotation, Vector3.one).inverse * bone.localToWorldMatrix, for each bone of each
// character: where the bone is from its root, with the scales of both. Origins and orientations have the root's place.
inline cab::PoseView poses_of(const Matrix4x4* matrices) {
  cab::PoseView poses;
  poses.format = cab::PoseFormat::kMatrix4x4Columns;
  poses.data = &matrices->m00;
  poses.has_scale = true;  // the same along all axes
  return poses;
}

// math.mul(math.inverse(root), bone), for each bone of each character. 28 bytes each: the default strides are right.
inline cab::PoseView poses_of(const RigidTransform* transforms) {
  cab::PoseView poses;
  poses.format = cab::PoseFormat::kQuaternionTranslation;
  poses.data = transforms->rot;
  return poses;
}
// end quote

}  // namespace as_in_unity
