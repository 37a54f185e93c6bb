// `cab crowd --mpi` in a build without MPI.
#include <doctest/doctest.h>

#include "tests/perf/cli/spawn.h"

namespace cab::tests {

TEST_CASE("a cab that was built without MPI says how to build it in") {
  const Outcome outcome = run_command("crowd", {"--scene", "uniform", "--mpi"});
  CHECK(outcome.exit_code == 1);
  CHECK(outcome.out.empty());
  CHECK(outcome.error == "cab: --mpi: this cab was built without MPI; configure with -D CAB_BUILD_MPI=ON\n");
}

TEST_CASE("one process takes no crowd that several could share") {
  const Outcome outcome = run_command("crowd", {"--scene", "uniform", "--characters", "4000001"});
  CHECK(outcome.exit_code == 2);
  CHECK(outcome.error.find("at most 4000000") != std::string::npos);
}

}  // namespace cab::tests
