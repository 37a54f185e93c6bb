// What `cab peers --robot` measures: ways to tell which states of a robot collide.
#pragma once

#include <cab/span.h>
#include <cab/types.h>

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "scenes/robot/robot.h"

namespace cab::perf {

// The pairs of links with shapes that everybody tests, and the others, each with the lower index first.
struct RobotPairs {
  std::vector<LinkPair> tested, masked;
};

struct RobotSetup {
  std::string name;
  std::string meaning;
  // Writes for each state whether links touch: 1 or 0.
  std::function<void(Span<const double> states, Span<std::uint8_t> touching)> check;
};

// FCL's set-up for the same links, joints, shapes and triangles, in double. The robot must outlive it.
RobotSetup fcl_setup(const scenes::Robot& robot, const RobotPairs& pairs, const scenes::LeafTriangles& triangles);

// MuJoCo's set-ups for the same links, joints and shapes, and its version; of builds with it alone. The robot must
// outlive the set-ups. Throws std::runtime_error with MuJoCo's reason if it refuses the robot.
std::vector<RobotSetup> mujoco_setups(const scenes::Robot& robot, const RobotPairs& pairs);
std::string mujoco_version();

}  // namespace cab::perf
