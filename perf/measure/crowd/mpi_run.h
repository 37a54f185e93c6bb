// `cab crowd --mpi`: one crowd by all ranks.
#pragma once

#include <functional>
#include <string>

#include "perf/measure/crowd/options.h"
#include "scenes/crowd/crowd.h"

namespace cab::perf {

// Runs all frames, or goes on from a checkpoint, and prints on rank 0 what was found and sent. make: the crowd, on each
// rank; `quiet` is set on all ranks but 0. program: a text of all that decides the hits. Returns the exit code. Throws
// std::runtime_error in a build without MPI.
int run_by_mpi(const CrowdOptions& options, const std::string& program,
               const std::function<scenes::Crowd(bool quiet)>& make);

}  // namespace cab::perf
