// Forward kinematics of a robot, and states of its joints.
#pragma once

#include "scenes/robot/robot.h"

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

// The motion of each link, from its frame to the robot's, by the value of each variable. `links` has room for all.
void pose_links(const Robot& robot, const double* state, RigidMotion* links);

// The same rounded to float, as PoseFormat::kQuaternionTranslation: seven floats per link.
void write_poses(const Robot& robot, const double* state, float* poses);

}  // namespace cab::scenes
