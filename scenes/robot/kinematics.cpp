// Forward kinematics of a robot, and states of its joints.
#include "scenes/robot/kinematics.h"

#include "scenes/random.h"

#include <cab/cab.h>

#include <algorithm>
#include <new>
#include <stdexcept>
#include <string>

namespace cab::scenes {

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

Kinematics::Kinematics(const Robot& robot)
    : parents_(robot.body.link_parents), variable_count_(static_cast<std::uint32_t>(robot.variables.size())) {
  for (const RobotLink& link : robot.links) {
    LinkPlaceDesc& to = links_.emplace_back();
    const Quat rotation = normalized(link.place.rotation);
    std::copy(rotation.begin(), rotation.end(), to.rotation);
    std::copy(link.place.translation.begin(), link.place.translation.end(), to.translation);
    to.joint_count = link.joint_count;
    for (std::uint32_t j = link.first_joint; j < link.first_joint + link.joint_count; ++j) {
      const RobotJoint& from = robot.joints[j];
      JointDesc& joint = joints_.emplace_back();
      joint.kind = from.kind;
      joint.variable = from.variable;
      std::copy(from.axis.begin(), from.axis.end(), joint.axis);
      std::copy(from.anchor.begin(), from.anchor.end(), joint.anchor);
      joint.multiplier = from.multiplier;
      joint.offset = from.offset;
    }
  }
}

void Kinematics::write_poses(Span<const double> states, Span<float> poses, Isa isa) const {
  const Status status = compute_link_poses(desc(), states, isa, poses);
  if (status == Status::kOutOfMemory) throw std::bad_alloc();
  if (status != Status::kOk) throw std::logic_error(std::string("the poses of a robot: ") + to_string(status));
}

}  // namespace cab::scenes
