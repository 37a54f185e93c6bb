#include "engine/between/link_path.h"

#include "engine/exact/leaf_pairs.h"
#include "engine/step/quaternion_of.h"

#include <algorithm>
#include <cmath>

namespace cab {
namespace {

using Matrix = double[3][3];  // [row][column]

double determinant_sign(const kernel::RigidLanes<double>& pose) {
  return kernel::dot(kernel::cross(pose.column[0], pose.column[1]), pose.column[2]) < 0 ? -1 : 1;
}

// The rotation that takes the columns of one pose to those of another.
void rotation_between(const kernel::RigidLanes<double>& from, const kernel::RigidLanes<double>& to, Matrix& out) {
  const auto at = [](const Double3& v, int c) { return c == 0 ? v.x : c == 1 ? v.y : v.z; };
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) {
      out[r][c] = 0;
      for (int k = 0; k < 3; ++k) out[r][c] += at(to.column[k], r) * at(from.column[k], c);
    }
}

}  // namespace

LinkPath::LinkPath(const InstanceBatch& last, const InstanceBatch& now, std::uint32_t instance, std::uint32_t link) {
  const bool known = is_active(last, instance) && is_valid_pose(last, instance, link);
  const InstanceBatch* const frames[] = {known ? &last : &now, &now};
  for (int f = 0; f < 2; ++f) {
    pose_[f] = pose_in_double(stored_pose(*frames[f], instance, link));
    for (std::uint32_t c = 0; c < 3; ++c) origin_[f][c] = origin_of(*frames[f], instance, c);
  }
  if (determinant_sign(pose_[0]) != determinant_sign(pose_[1])) {
    pose_[0] = pose_[1];
    std::copy_n(origin_[1], 3, origin_[0]);
  }
  Matrix turn;
  rotation_between(pose_[0], pose_[1], turn);
  double q[4];
  quaternion_of(turn, q);
  std::copy_n(q, 3, axis_);
  cosine_ = q[3];
}

// The quaternions between that of no rotation and another, on the straight line and then of length 1, are rotations
// about one axis.
void LinkPath::pose_at(double t, float (&matrix)[12]) const {
  const double w = (1 - t) + t * cosine_;
  const Double3 v = {t * axis_[0], t * axis_[1], t * axis_[2]};
  const double twice = 2 / (w * w + kernel::dot(v, v));
  const double scale = scale_at(t);
  const Double3 translation = pose_[0].translation + t * (pose_[1].translation - pose_[0].translation);
  for (int k = 0; k < 3; ++k) {
    const Double3& column = pose_[0].column[k];
    const Double3 across = kernel::cross(v, column);
    const Double3 turned = column + twice * (w * across + kernel::cross(v, across));
    matrix[k] = static_cast<float>(scale * turned.x);
    matrix[4 + k] = static_cast<float>(scale * turned.y);
    matrix[8 + k] = static_cast<float>(scale * turned.z);
  }
  matrix[3] = static_cast<float>(translation.x);
  matrix[7] = static_cast<float>(translation.y);
  matrix[11] = static_cast<float>(translation.z);
}

// The quaternion on the straight line is shortest half way, where the angle grows fastest: by four times the tangent of
// a quarter of the angle.
double LinkPath::most_turn() const {
  return 4 * std::sqrt(axis_[0] * axis_[0] + axis_[1] * axis_[1] + axis_[2] * axis_[2]) / (1 + cosine_);
}

}  // namespace cab
