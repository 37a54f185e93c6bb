// Forward kinematics of a robot, and states of its joints.
#pragma once

#include "scenes/robot/robot.h"

#include <cab/span.h>
#include <cab/types.h>

#include <cstdint>
#include <vector>

namespace cab::scenes {

// The motion b, then a.
RigidMotion compose(const RigidMotion& a, const RigidMotion& b);

// The value of each variable at rest.
std::vector<double> rest_state(const Robot& robot);

// Writes a random value for each variable. State `index` of a seed does not depend on other states. Variables are
// uniform within their limits. A ball joint turns about a uniform direction by a uniform angle.
void random_state(const Robot& robot, std::uint64_t seed, std::uint64_t index, double* state);

// The joints of a robot, for the poses of its states.
class Kinematics {
 public:
  explicit Kinematics(const Robot& robot);

  // Writes the poses of states, as compute_link_poses does. Throws std::bad_alloc.
  void write_poses(Span<const double> states, Span<float> poses, Isa isa = Isa::kAuto) const;

  std::size_t pose_floats() const { return 7 * links_.size(); }  // of a state

  KinematicsDesc desc() const { return {parents_, links_, joints_, variable_count_}; }

 private:
  std::vector<std::int32_t> parents_;
  std::vector<LinkPlaceDesc> links_;
  std::vector<JointDesc> joints_;
  std::uint32_t variable_count_;
};

}  // namespace cab::scenes
