// All ranks get one answer.
#include "engine/mpi/agreement.h"

#include <doctest/doctest.h>

#include <string>

namespace cab::tests {

TEST_CASE("a failure of one rank is the answer of all, and so is a difference") {
  int rank = 0, ranks = 1;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  MPI_Comm_size(MPI_COMM_WORLD, &ranks);
  const int last = ranks - 1;
  CHECK(mpi::agree(MPI_COMM_WORLD, Status::kOk, 7, mpi::Difference::kJob).ok());

  const Status own = rank == last ? Status::kBadPoses : Status::kOk;
  const mpi::Answer failed = mpi::agree(MPI_COMM_WORLD, own, static_cast<std::uint64_t>(rank), mpi::Difference::kJob);
  CHECK(failed.status == Status::kBadPoses);
  CHECK(failed.rank == last);

  if (last == 0) return;
  const std::uint64_t digest = rank == last ? 8 : 7;
  const mpi::Answer differs = mpi::agree(MPI_COMM_WORLD, Status::kOk, digest, mpi::Difference::kVersion);
  CHECK(!differs.ok());
  CHECK(differs.status == Status::kOk);
  CHECK(differs.difference == mpi::Difference::kVersion);
  CHECK(differs.rank == last);
}

TEST_CASE("every difference has words of its own") {
  CHECK(std::string(mpi::to_string(mpi::Difference::kVersion)).find("version") != std::string::npos);
  CHECK(mpi::to_string(mpi::Difference::kJob) != std::string(mpi::to_string(mpi::Difference::kAdded)));
}

}  // namespace cab::tests
