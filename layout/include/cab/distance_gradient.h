// The gradient of a distance to the variables of a robot: how fast a point of a link moves along a direction.
// CollisionChecker::find_nearest writes it. No part of the API: it may change in any version.
#pragma once

#include <cab/kinematics.h>

#include <cmath>
#include <cstddef>

namespace cab::detail {

// Adds to `gradient` (variable_count numbers), for every variable, `factor` times the speed along `direction` (x y z,
// of length 1) at which a point of a link moves with it. state: variable_count numbers. poses: 7 numbers per link, as
// compute_link_poses writes them for the state. link: of the point. point: x y z in the robot's frame, in its unit.
// `kinematics` must be one that compute_link_poses takes. A variable that does not move the point has the speed 0.
inline void add_gradient(const KinematicsDesc& kinematics, const double* state, const float* poses, std::size_t link,
                         const float (&point)[3], const float (&direction)[3], double factor,
                         double* gradient) noexcept {
  struct Vector {
    double x, y, z;
  };
  struct Turn {
    double x, y, z, w;
  };
  const auto cross = [](const Vector& a, const Vector& b) {
    return Vector{a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
  };
  const auto dot = [](const Vector& a, const Vector& b) { return a.x * b.x + a.y * b.y + a.z * b.z; };
  const auto plus = [](const Vector& a, double by, const Vector& b) {
    return Vector{a.x + by * b.x, a.y + by * b.y, a.z + by * b.z};
  };
  const auto rotate = [&](const Turn& q, const Vector& v) {
    const Vector axis = {q.x, q.y, q.z}, t = cross(axis, v);
    return plus(plus(v, 2 * q.w, t), 2, cross(axis, t));
  };
  const auto times = [](const Turn& a, const Turn& b) {
    return Turn{a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y, a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
                a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w, a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z};
  };
  const Vector at = {static_cast<double>(point[0]), static_cast<double>(point[1]), static_cast<double>(point[2])};
  const Vector along = {static_cast<double>(direction[0]), static_cast<double>(direction[1]),
                        static_cast<double>(direction[2])};
  for (std::int32_t l = static_cast<std::int32_t>(link); l >= 0;
       l = kinematics.link_parents[static_cast<std::size_t>(l)]) {
    const auto here = static_cast<std::size_t>(l);
    std::size_t first = 0;
    for (std::size_t before = 0; before < here; ++before) first += kinematics.links[before].joint_count;
    const float* const pose = poses + 7 * here;
    // The frame that joints leave, from that of the link back to that before its first joint.
    Turn turn = {static_cast<double>(pose[0]), static_cast<double>(pose[1]), static_cast<double>(pose[2]),
                 static_cast<double>(pose[3])};
    Vector origin = {static_cast<double>(pose[4]), static_cast<double>(pose[5]), static_cast<double>(pose[6])};
    for (std::size_t j = first + kinematics.links[here].joint_count; j-- > first;) {
      const JointDesc& joint = kinematics.joints[j];
      const Vector axis = {joint.axis[0], joint.axis[1], joint.axis[2]},
                   anchor = {joint.anchor[0], joint.anchor[1], joint.anchor[2]};
      const double by = factor * joint.multiplier;
      const auto value = [&](std::size_t v) { return joint.multiplier * state[joint.variable + v] + joint.offset; };
      if (joint.kind == JointKind::kPrismatic) {
        const Vector moved = rotate(turn, axis);
        gradient[joint.variable] += by * dot(moved, along);
        origin = plus(origin, -value(0), moved);
        continue;
      }
      const Vector center = plus(origin, 1, rotate(turn, anchor)), arm = plus(at, -1, center);
      // A turn by w moves the point at cross(w, arm), so along the direction at dot(w, cross(arm, along)).
      const Vector moment = cross(arm, along);
      Vector about = axis;
      double half = value(0) / 2;
      if (joint.kind == JointKind::kBall) {
        about = {value(0), value(1), value(2)};
        const double angle = std::sqrt(dot(about, about));
        half = angle / 2;
        about = angle > 0 ? Vector{about.x / angle, about.y / angle, about.z / angle} : Vector{0, 0, 1};
      }
      const double sine = std::sin(half);
      turn = times(turn, {-sine * about.x, -sine * about.y, -sine * about.z, std::cos(half)});
      origin = plus(center, -1, rotate(turn, anchor));
      if (joint.kind == JointKind::kRevolute) {
        gradient[joint.variable] += by * dot(rotate(turn, axis), moment);
        continue;
      }
      // A rotation vector r, of length a about the axis u, that grows by e turns by
      // (sin a / a) e + (1 - sin a / a) u (u . e) + ((1 - cos a) / a) cross(u, e).
      const double angle = 2 * half, small = angle < 1e-4 ? 1 - angle * angle / 6 : std::sin(angle) / angle,
                   bent = angle < 1e-4 ? angle / 2 : (1 - std::cos(angle)) / angle;
      const Vector unit[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
      for (std::size_t v = 0; v < 3; ++v) {
        const Vector& e = unit[v];
        Vector w = {small * e.x, small * e.y, small * e.z};
        w = plus(plus(w, (1 - small) * dot(about, e), about), bent, cross(about, e));
        gradient[joint.variable + v] += by * dot(rotate(turn, w), moment);
      }
    }
  }
}

}  // namespace cab::detail
