#include "engine/mpi/agreement.h"

#include <limits>

namespace cab::mpi {

Answer agree(MPI_Comm comm, Status status, std::uint64_t digest, Difference difference) noexcept {
  int rank = 0;
  MPI_Comm_rank(comm, &rank);
  constexpr std::uint64_t kNoFailure = std::numeric_limits<std::uint64_t>::max();
  constexpr int kRankShift = 32;
  const std::uint64_t failure =
      status == Status::kOk ? kNoFailure
                            : static_cast<std::uint64_t>(rank) << kRankShift | static_cast<std::uint64_t>(status);
  // The least of all ranks: the failure of the lowest rank, the least digest, and the complement of the largest.
  std::uint64_t least[] = {failure, digest, ~digest};
  MPI_Allreduce(MPI_IN_PLACE, least, 3, MPI_UINT64_T, MPI_MIN, comm);
  if (least[0] != kNoFailure)
    return {static_cast<Status>(least[0] & 0xffffffffu), Difference::kNone,
            static_cast<std::int32_t>(least[0] >> kRankShift)};
  if (least[1] == ~least[2]) return {};
  std::uint64_t first = digest;
  MPI_Bcast(&first, 1, MPI_UINT64_T, 0, comm);
  int differs = digest == first ? std::numeric_limits<int>::max() : rank;
  MPI_Allreduce(MPI_IN_PLACE, &differs, 1, MPI_INT, MPI_MIN, comm);
  return {Status::kOk, difference, differs};
}

const char* to_string(Difference difference) noexcept {
  switch (difference) {
    case Difference::kNone: return "nothing differs";
    case Difference::kVersion: return "the version of cab, or which exact tests it was built with, differs";
    case Difference::kProgram: return "the program or its options differ";
    case Difference::kAdded: return "what was added to the engine differs";
    case Difference::kJob:
      return "rules, policies, margins, depth, containment, report or contacts of the frame differ";
    case Difference::kMembers: return "the format of poses, or which spans are given for a batch, differs";
    case Difference::kNumbers: return "an instance is on two ranks";
  }
  return "an unknown difference";
}

}  // namespace cab::mpi
