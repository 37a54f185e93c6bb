#include <stdexcept>

#include "perf/measure/crowd/mpi_run.h"

namespace cab::perf {

int run_by_mpi(const CrowdOptions&, const std::string&, const std::function<scenes::Crowd(bool quiet)>&) {
  throw std::runtime_error("--mpi: this cab was built without MPI; configure with -D CAB_BUILD_MPI=ON");
}

}  // namespace cab::perf
