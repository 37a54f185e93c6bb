// The task runner of a library without TBB.
#include "engine/step/task_runner.h"

namespace cab {

std::unique_ptr<TaskRunner> make_tbb_task_runner(std::uint32_t) { return nullptr; }

bool has_tbb() { return false; }

}  // namespace cab
