// Forward kinematics, states as lanes of doubles.
#pragma once

#include "kernels/sine.h"
#include "kernels/vec3.h"

#include <cab/kinematics.h>

#include <algorithm>
#include <cmath>

namespace cab::kernel {

// Up to sixteen states of a body.
struct StateTile {
  const KinematicsDesc& desc;  // valid
  const double* states;        // desc.variable_count numbers per state
  std::uint32_t count;         // of states, 1 to kLanes
  double* links;               // scratch, 7 kLanes per link, aligned to 64 bytes
  float* poses;                // receives 7 per state and link
};

// A rotation by a quaternion of length 1, then a translation.
template <class D>
struct MotionLanes {
  Vec3<D> axis;  // x y z of the quaternion
  D w;
  Vec3<D> translation;
};

template <class D>
CAB_INLINE Vec3<D> rotate(const Vec3<D>& axis, D w, const Vec3<D>& v) {
  const Vec3<D> twice = D(2.) * cross(axis, v);
  return v + (w * twice + cross(axis, twice));
}

// Moves a motion's frame by v, which is in that frame.
template <class D>
CAB_INLINE void move(MotionLanes<D>& motion, const Vec3<D>& v) {
  motion.translation = motion.translation + rotate(motion.axis, motion.w, v);
}

// Turns a motion's frame about its origin.
template <class D>
CAB_INLINE void turn(MotionLanes<D>& motion, const Vec3<D>& axis, D w) {
  const D product = motion.w * w - dot(motion.axis, axis);
  motion.axis = (motion.w * axis + w * motion.axis) + cross(motion.axis, axis);
  motion.w = product;
}

template <class D>
CAB_INLINE Vec3<D> spread(const double (&v)[3]) {
  return {D(v[0]), D(v[1]), D(v[2])};
}

// Loads the values of a variable of the states from `first` on: multiplier * variable + offset.
template <class D>
CAB_INLINE D joint_value(const StateTile& tile, const JointDesc& joint, std::uint32_t first, std::uint32_t which) {
  alignas(64) double value[kLanes];
  const double* const from = tile.states + joint.variable + which;
  for (std::uint32_t lane = 0; lane < kWidth<D>; ++lane)
    value[lane] = from[std::size_t{std::min(first + lane, tile.count - 1)} * tile.desc.variable_count];
  return D(joint.multiplier) * Lanes<D>::load(value) + D(joint.offset);
}

// Half an angle of any size, within the range of sine_cosine.
template <class D>
CAB_INLINE D half_angle(D angle) {
  constexpr double kFourPi = 12.566370614359172;
  if (bits(D(kMaxSineAngle) < abs(angle)) == 0) return D(.5) * angle;
  alignas(64) double value[kLanes];
  Lanes<D>::store(value, angle);
  for (std::uint32_t lane = 0; lane < kWidth<D>; ++lane)
    if (std::fabs(value[lane]) > kMaxSineAngle) value[lane] = std::fmod(value[lane], kFourPi);
  return D(.5) * Lanes<D>::load(value);
}

// Moves a motion's frame by a joint.
template <class D>
CAB_INLINE void move_by_joint(const StateTile& tile, const JointDesc& joint, std::uint32_t first,
                              MotionLanes<D>& motion) {
  const D value = joint_value<D>(tile, joint, first, 0);
  if (joint.kind == JointKind::kPrismatic) return move(motion, value * spread<D>(joint.axis));
  Vec3<D> axis;
  D sine, cosine;
  if (joint.kind == JointKind::kRevolute) {
    sine_cosine(half_angle(value), &sine, &cosine);
    axis = sine * spread<D>(joint.axis);
  } else {
    const Vec3<D> turned = {value, joint_value<D>(tile, joint, first, 1), joint_value<D>(tile, joint, first, 2)};
    const D angle = sqrt(dot(turned, turned));
    sine_cosine(half_angle(angle), &sine, &cosine);
    axis = select(D(0.) < angle, divide(sine, angle), select(angle < D(1.), D(.5), angle)) * turned;
  }
  const Vec3<D> anchor = spread<D>(joint.anchor);
  const bool has_anchor = joint.anchor[0] != 0 || joint.anchor[1] != 0 || joint.anchor[2] != 0;
  if (has_anchor) move(motion, anchor);
  turn(motion, axis, cosine);
  if (has_anchor) move(motion, D(-1.) * anchor);
}

template <class V>
void pose_states(const StateTile& tile) {
  using D = DoubleOf<V>;
  constexpr std::uint32_t kStates = kWidth<D>;
  const std::size_t link_count = tile.desc.link_parents.size;
  for (std::uint32_t first = 0; first < tile.count; first += kStates) {
    const JointDesc* joint = tile.desc.joints.data;
    const std::uint32_t count = std::min(kStates, tile.count - first);
    for (std::size_t l = 0; l < link_count; ++l) {
      const LinkPlaceDesc& link = tile.desc.links[l];
      const double* const q = link.rotation;
      const Vec3<D> axis = {D(q[0]), D(q[1]), D(q[2])}, translation = spread<D>(link.translation);
      MotionLanes<D> motion = {axis, D(q[3]), translation};
      if (const std::int32_t parent = tile.desc.link_parents[l]; parent >= 0) {
        const double* const p = tile.links + 7 * kStates * static_cast<std::size_t>(parent);
        const auto load = [p](std::uint32_t c) { return Lanes<D>::load(p + c * kStates); };
        motion = {{load(0), load(1), load(2)}, load(3), {load(4), load(5), load(6)}};
        move(motion, translation);
        turn(motion, axis, D(q[3]));
      }
      for (std::uint32_t j = 0; j < link.joint_count; ++j) move_by_joint(tile, *joint++, first, motion);
      double* const to = tile.links + 7 * kStates * l;
      const D all[] = {motion.axis.x,        motion.axis.y,        motion.axis.z,       motion.w,
                       motion.translation.x, motion.translation.y, motion.translation.z};
      for (std::uint32_t c = 0; c < 7; ++c) Lanes<D>::store(to + c * kStates, all[c]);
      float* const poses = tile.poses + 7 * l;
      for (std::uint32_t lane = 0; lane < count; ++lane)
        for (std::uint32_t c = 0; c < 7; ++c)
          poses[std::size_t{first + lane} * 7 * link_count + c] = static_cast<float>(to[c * kStates + lane]);
    }
  }
}

}  // namespace cab::kernel
