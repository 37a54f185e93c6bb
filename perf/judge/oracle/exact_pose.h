// The judge of frames: leaf boxes posed in long double, and an overlap test that shares no code with the engine's.
#pragma once

#include "perf/harness/random_rig.h"
#include "perf/judge/oracle/oracle_box.h"
#include "perf/judge/oracle/real.h"

#include <cmath>
#include <vector>

namespace cab::oracle {

using ExactBox = OracleBox<Real>;

// What a stored pose means: a quaternion of any length, or a matrix, mirrored or not, made orthonormal with its first
// column kept. The scale is that of the instance or the length of the matrix's first column.
inline ExactPose exact_pose(const Poses& poses, std::uint32_t instance, std::uint32_t link) {
  const float* const f = poses.pose(instance, link);
  ExactPose out{};
  if (poses.format == PoseFormat::kQuaternionTranslation) {
    const Real q[4] = {f[0], f[1], f[2], f[3]};
    quaternion_matrix(q, out.column);
    out.at = {{f[4], f[5], f[6]}};
  } else {
    const bool rows = poses.format == PoseFormat::kMatrix3x4Rows;
    Point m[3];
    for (std::size_t k = 0; k < 3; ++k)
      for (std::size_t c = 0; c < 3; ++c) m[k][c] = f[rows ? 4 * c + k : 4 * k + c];
    for (std::size_t c = 0; c < 3; ++c) out.at[c] = f[rows ? 4 * c + 3 : 12 + c];
    if (poses.has_scale) out.scale = std::sqrt(dot(m[0], m[0]));
    for (Point& column : m) column = (1 / out.scale) * column;
    m[0] = (1 / std::sqrt(dot(m[0], m[0]))) * m[0];
    m[1] = m[1] - dot(m[1], m[0]) * m[0];
    m[1] = (1 / std::sqrt(dot(m[1], m[1]))) * m[1];
    const Point right_handed = cross(m[0], m[1]);
    m[2] = (dot(right_handed, m[2]) < 0 ? Real{-1} : Real{1}) * right_handed;
    for (std::size_t k = 0; k < 3; ++k) store(m[k], out.column[k]);
  }
  if (!poses.scales.empty()) {
    out.scale = poses.scales[instance];
    out.at = out.scale * out.at;
  }
  if (!poses.orientations.empty()) {
    const float* const o = poses.orientations.data() + 4 * std::size_t{instance};
    const Real q[4] = {o[0], o[1], o[2], o[3]};
    Real turn[3][3];
    quaternion_matrix(q, turn);
    for (auto& column : out.column) store(rotated(turn, to_vec3(column)), column);
    out.at = rotated(turn, out.at);
  }
  return out;
}

// The leaf boxes of one instance relative to its origin, exactly as the caller described them.
inline std::vector<ExactBox> exact_leaf_boxes(const Rig& rig, const Poses& poses, std::uint32_t instance) {
  std::vector<ExactBox> out;
  for (const Leaf& leaf : rig.leaves) {
    const ExactPose pose = exact_pose(poses, instance, leaf.link);
    ExactBox box{};
    store(pose.at + rotated(pose.column, pose.scale * convert<Real>(to_vec3(leaf.box.center))), box.center);
    for (std::size_t k = 0; k < 3; ++k) {
      store(rotated(pose.column, convert<Real>(to_vec3(leaf.box.axis[k]))), box.axis[k]);
      box.half[k] = pose.scale * leaf.box.half[k];
    }
    out.push_back(box);
  }
  return out;
}

// Whether two parallelepipeds overlap, without slack. The separating axes are the normals of their faces and the cross
// products of their edges. between: the centre of b less the centre of a.
inline bool exactly_overlap(const ExactBox& a, const ExactBox& b, const Point& between) {
  const auto apart_along = [&](const Point& direction) {
    Real reach = 0;
    for (std::size_t k = 0; k < 3; ++k)
      reach +=
          a.half[k] * std::fabs(dot(axis_of(a, k), direction)) + b.half[k] * std::fabs(dot(axis_of(b, k), direction));
    return std::fabs(dot(between, direction)) > reach;
  };
  for (std::size_t i = 0; i < 3; ++i) {
    if (apart_along(cross(axis_of(a, i), axis_of(a, (i + 1) % 3)))) return false;
    if (apart_along(cross(axis_of(b, i), axis_of(b, (i + 1) % 3)))) return false;
    for (std::size_t j = 0; j < 3; ++j)
      if (apart_along(cross(axis_of(a, i), axis_of(b, j)))) return false;
  }
  return true;
}

inline Point exact_origin(const Poses& poses, std::uint32_t instance) {
  if (poses.origins.empty()) return {};
  const double* const o = poses.origins.data() + 3 * std::size_t{instance};
  return {{o[0], o[1], o[2]}};
}

}  // namespace cab::oracle
