#include "perf/tools/robot/choose_matrix.h"

namespace cab::perf {

scenes::Matrix choose_matrix(const RobotCommandOptions& options, const scenes::Robot& robot,
                             const std::vector<LinkPair>& disabled, const scenes::RobotSessionOptions& session) {
  scenes::MatrixOptions matrix;
  matrix.excluded = robot.body.ignored_pairs;
  matrix.excluded.insert(matrix.excluded.end(), disabled.begin(), disabled.end());
  matrix.derive = options.srdf_path.empty();
  matrix.samples = matrix.derive ? options.samples : 0;
  matrix.seed = options.seed;
  matrix.margin = static_cast<float>(options.margin);
  return scenes::make_matrix(robot, matrix, session);
}

}  // namespace cab::perf
