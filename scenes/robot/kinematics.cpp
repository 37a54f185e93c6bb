// Forward kinematics of a robot, and states of its joints.
#include "scenes/robot/kinematics.h"

#include "scenes/random.h"

#include <cmath>

namespace cab::scenes {
namespace {

Quat turn(const Vec3& axis, double angle) {
  const Vec3 v = std::sin(.5 * angle) * axis;
  return {v[0], v[1], v[2], std::cos(.5 * angle)};
}

// How a joint moves the frame of its link.
RigidMotion motion_of(const RobotJoint& joint, const double* state) {
  const auto value = [&](std::size_t k) { return joint.multiplier * state[joint.variable + k] + joint.offset; };
  RigidMotion motion;
  if (joint.kind == JointKind::kPrismatic) {
    motion.translation = value(0) * joint.axis;
    return motion;
  }
  if (joint.kind == JointKind::kRevolute) {
    motion.rotation = turn(joint.axis, value(0));
  } else {
    const Vec3 vector = {value(0), value(1), value(2)};
    const double angle = length(vector);
    if (angle > 0) motion.rotation = turn((1 / angle) * vector, angle);
  }
  motion.translation = joint.anchor - rotate(motion.rotation, joint.anchor);
  return motion;
}

}  // namespace

RigidMotion compose(const RigidMotion& a, const RigidMotion& b) {
  return {normalized(multiply(a.rotation, b.rotation)), a.translation + rotate(a.rotation, b.translation)};
}

std::vector<double> rest_state(const Robot& robot) {
  std::vector<double> state;
  for (const RobotVariable& variable : robot.variables) state.push_back(variable.rest);
  return state;
}

void random_state(const Robot& robot, std::uint64_t seed, std::uint64_t index, double* state) {
  Random random = Random::of(seed, index);
  for (std::size_t v = 0; v < robot.variables.size(); ++v)
    state[v] = random.uniform(robot.variables[v].lower, robot.variables[v].upper);
  for (const RobotJoint& joint : robot.joints) {
    if (joint.kind != JointKind::kBall) continue;
    const Vec3 vector = random.uniform(0, robot.variables[joint.variable].upper) * random.unit_vector();
    for (std::size_t k = 0; k < 3; ++k) state[joint.variable + k] = vector[k];
  }
}

void pose_links(const Robot& robot, const double* state, RigidMotion* links) {
  for (std::size_t l = 0; l < robot.links.size(); ++l) {
    const RobotLink& link = robot.links[l];
    const std::int32_t parent = robot.body.link_parents[l];
    links[l] = parent < 0 ? link.place : compose(links[parent], link.place);
    for (std::uint32_t j = link.first_joint; j < link.first_joint + link.joint_count; ++j)
      links[l] = compose(links[l], motion_of(robot.joints[j], state));
  }
}

void write_poses(const Robot& robot, const double* state, float* poses) {
  std::vector<RigidMotion> links(robot.links.size());
  pose_links(robot, state, links.data());
  for (const RigidMotion& link : links) {
    for (const double component : link.rotation) *poses++ = static_cast<float>(component);
    for (const double component : link.translation) *poses++ = static_cast<float>(component);
  }
}

}  // namespace cab::scenes
