// Joint states from a file.
#pragma once

#include "scenes/robot/robot.h"

#include <optional>
#include <string>
#include <vector>

namespace cab::scenes {

// States of a robot's joints, one value per variable: [state][variable].
struct JointStates {
  std::vector<double> values;
  std::size_t count = 0;
  std::vector<std::string> notes;
};

// Reads CSV: a line of names of variables in any order, then one line of numbers per state, in radians and metres.
// Empty lines and lines that begin with # are passed over. Variables without a column stay at rest, and columns of
// joints that follow another joint are not used; both are noted, and so are values beyond a limit. With `sandbox` a
// child process reads it. Throws ImportError that names the file, the line and the reason.
JointStates read_joint_states(const std::string& path, const Robot& robot, const std::optional<SandboxLimits>& sandbox);

}  // namespace cab::scenes
