// The allowed-collision matrix of a robot that a command line asks for.
#pragma once

#include "perf/tools/robot/options.h"
#include "scenes/robot/matrix.h"

namespace cab::perf {

// `disabled` are the pairs of the SRDF file that the options name. If they name none, pairs are derived and sampled.
scenes::Matrix choose_matrix(const RobotCommandOptions& options, const scenes::Robot& robot,
                             const std::vector<LinkPair>& disabled, const scenes::RobotSessionOptions& session);

}  // namespace cab::perf
