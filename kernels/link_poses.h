// Forward kinematics, states as lanes of doubles.
#pragma once

#include "kernels/pose_between.h"
#include "kernels/sine.h"
#include "kernels/transpose.h"
#include "kernels/vec3.h"

#include <cab/kinematics.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace cab::kernel {

// Up to sixteen states of a body. Unused lanes repeat the last state.
struct StateTile {
  const KinematicsDesc& desc;  // valid
  const double* states;        // desc.variable_count numbers per state
  std::uint32_t count;         // of states, 1 to kLanes
  double* scratch;             // 7 kLanes per link, aligned to 64 bytes
  float* block;                // scratch: as many floats
  RawPoses* links;             // receives the poses of each link, seven floats for each state
  float* poses;                // receives the same, seven per state and link
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

// One number of each row, in lanes. Not by way of memory, which waits until all of them are stored.
template <class D, std::size_t... kLane>
CAB_INLINE D gathered(const double* const* rows, std::size_t at, std::index_sequence<kLane...>) {
  return D{rows[kLane][at]...};
}

// The values of a variable of the states at `rows`: multiplier * variable + offset.
template <class D>
CAB_INLINE D joint_value(const double* const* rows, const JointDesc& joint, std::uint32_t which) {
  const D variable = gathered<D>(rows, std::size_t{joint.variable} + which, std::make_index_sequence<kWidth<D>>());
  return D(joint.multiplier) * variable + D(joint.offset);
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

// Whether three numbers are 0.
CAB_INLINE bool is_zero(const double* v) {
  return std::fabs(v[0]) <= 0 && std::fabs(v[1]) <= 0 && std::fabs(v[2]) <= 0;
}

// Moves a motion's frame by a joint.
template <class D>
CAB_INLINE void move_by_joint(const double* const* rows, const JointDesc& joint, MotionLanes<D>& motion) {
  const D value = joint_value<D>(rows, joint, 0);
  if (joint.kind == JointKind::kPrismatic) return move(motion, value * spread<D>(joint.axis));
  Vec3<D> axis;
  D sine, cosine;
  if (joint.kind == JointKind::kRevolute) {
    sine_cosine(half_angle(value), &sine, &cosine);
    axis = sine * spread<D>(joint.axis);
  } else {
    const Vec3<D> turned = {value, joint_value<D>(rows, joint, 1), joint_value<D>(rows, joint, 2)};
    const D angle = sqrt(dot(turned, turned));
    sine_cosine(half_angle(angle), &sine, &cosine);
    axis = select(D(0.) < angle, divide(sine, angle), select(angle < D(1.), D(.5), angle)) * turned;
  }
  if (is_zero(joint.anchor)) return turn(motion, axis, cosine);
  const Vec3<D> anchor = spread<D>(joint.anchor);
  move(motion, anchor);
  turn(motion, axis, cosine);
  move(motion, D(-1.) * anchor);
}

// A quaternion times a turn by half a circle about an axis.
struct HalfCircle {
  double at[4];
};

CAB_INLINE HalfCircle half_circle(const double (&q)[4], const double (&axis)[3]) {
  return {{(q[3] * axis[0] + q[1] * axis[2]) - q[2] * axis[1], (q[3] * axis[1] + q[2] * axis[0]) - q[0] * axis[2],
           (q[3] * axis[2] + q[0] * axis[1]) - q[1] * axis[0], -((q[0] * axis[0] + q[1] * axis[1]) + q[2] * axis[2])}};
}

// Moves a motion's frame by a link's place and its joints.
template <class D>
CAB_INLINE void move_by_link(const double* const* rows, const LinkPlaceDesc& link, const JointDesc* joints,
                             MotionLanes<D>& motion) {
  const double(&q)[4] = link.rotation;
  const JointDesc* const end = joints + link.joint_count;
  if (!is_zero(link.translation)) move(motion, spread<D>(link.translation));
  if (joints != end && joints->kind == JointKind::kRevolute && is_zero(joints->anchor)) {
    // Place and joint together: cosine and sine of half the angle weigh the place, and the place after half a circle.
    const HalfCircle half = half_circle(q, joints->axis);
    D sine, cosine;
    sine_cosine(half_angle(joint_value<D>(rows, *joints, 0)), &sine, &cosine);
    const auto sum = [&](int k) { return cosine * D(q[k]) + sine * D(half.at[k]); };
    turn(motion, {sum(0), sum(1), sum(2)}, sum(3));
    ++joints;
  } else if (!is_zero(q)) {
    turn(motion, {D(q[0]), D(q[1]), D(q[2])}, D(q[3]));
  }
  for (; joints != end; ++joints) move_by_joint(rows, *joints, motion);
}

// Writes the poses of one link, seven floats for each state, which are `stride` floats apart.
template <class V>
CAB_INLINE void write_poses(const RawPoses& link, std::size_t stride, float* to) {
  for (std::uint32_t lane = 0; lane < kLanes; lane += kQuadRows<V>)
    for (const std::uint32_t at : {0u, 3u}) {  // two quads that share one float
      const float* const from[4] = {link.raw[at] + lane, link.raw[at + 1] + lane, link.raw[at + 2] + lane,
                                    link.raw[at + 3] + lane};
      scatter_quads<V>(from, stride, to + lane * stride + at);
    }
}

template <class V>
void pose_states(const StateTile& tile) {
  using D = DoubleOf<V>;
  constexpr std::uint32_t kStates = kWidth<D>;
  const std::size_t link_count = tile.desc.link_parents.size;
  const double* rows[kLanes];
  for (std::uint32_t lane = 0; lane < kLanes; ++lane)
    rows[lane] = tile.states + std::size_t{std::min(lane, tile.count - 1)} * tile.desc.variable_count;
  std::uint32_t first = 0;
  for (; first < tile.count; first += kStates) {
    const JointDesc* joints = tile.desc.joints.data;
    for (std::size_t l = 0; l < link_count; ++l) {
      const LinkPlaceDesc& link = tile.desc.links[l];
      MotionLanes<D> motion = {{D(0.), D(0.), D(0.)}, D(1.), {D(0.), D(0.), D(0.)}};
      if (const std::int32_t parent = tile.desc.link_parents[l]; parent >= 0) {
        const double* const p = tile.scratch + 7 * kStates * static_cast<std::size_t>(parent);
        const auto load = [p](std::uint32_t c) { return Lanes<D>::load(p + c * kStates); };
        motion = {{load(0), load(1), load(2)}, load(3), {load(4), load(5), load(6)}};
      }
      move_by_link(rows + first, link, joints, motion);
      joints += link.joint_count;
      double* const to = tile.scratch + 7 * kStates * l;
      const D all[] = {motion.axis.x,        motion.axis.y,        motion.axis.z,       motion.w,
                       motion.translation.x, motion.translation.y, motion.translation.z};
      for (std::uint32_t c = 0; c < 7; ++c) {
        Lanes<D>::store(to + c * kStates, all[c]);
        Lanes<D>::store(tile.links[l].raw[c] + first, all[c]);
      }
    }
  }
  for (std::size_t l = 0; l < link_count; ++l) {
    for (std::uint32_t c = 0; c < 7; ++c) {
      float(&lanes)[kLanes] = tile.links[l].raw[c];
      std::fill(lanes + first, lanes + kLanes, lanes[tile.count - 1]);
    }
    write_poses<V>(tile.links[l], 7 * link_count, tile.block + 7 * l);
  }
  std::copy_n(tile.block, tile.count * 7 * link_count, tile.poses);
}

}  // namespace cab::kernel
