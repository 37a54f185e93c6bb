#include "engine/mpi/agreement.h"

#include <cstddef>
#include <vector>

namespace cab::mpi {

Answer agree(MPI_Comm comm, Status status, std::uint64_t digest, Difference difference) {
  int ranks = 0;
  MPI_Comm_size(comm, &ranks);
  const std::uint64_t own[2] = {static_cast<std::uint64_t>(status), digest};
  std::vector<std::uint64_t> all(2 * static_cast<std::size_t>(ranks));
  MPI_Allgather(own, 2, MPI_UINT64_T, all.data(), 2, MPI_UINT64_T, comm);
  for (std::size_t r = 0; r < all.size() / 2; ++r)
    if (const auto other = static_cast<Status>(all[2 * r]); other != Status::kOk)
      return {other, Difference::kNone, static_cast<std::int32_t>(r)};
  for (std::size_t r = 0; r < all.size() / 2; ++r)
    if (all[2 * r + 1] != all[1]) return {Status::kOk, difference, static_cast<std::int32_t>(r)};
  return {};
}

const char* to_string(Difference difference) noexcept {
  switch (difference) {
    case Difference::kNone: return "nothing differs";
    case Difference::kVersion: return "the version of cab, or which exact tests it was built with, differs";
    case Difference::kProgram: return "the program or its options differ";
    case Difference::kAdded: return "what was added to the engine differs";
    case Difference::kJob: return "rules, policies, margins, report or contacts of the frame differ";
    case Difference::kMembers: return "the format of poses, or which spans are given for a batch, differs";
    case Difference::kNumbers: return "an instance is on two ranks";
  }
  return "an unknown difference";
}

}  // namespace cab::mpi
