// What all ranks answer together.
#pragma once

#include <cab/mpi.h>

#include <cstddef>
#include <cstdint>

namespace cab::mpi {

// What agree sends to every other rank.
inline constexpr std::size_t kAgreementBytes = 3 * sizeof(std::uint64_t);

// Compares the statuses and digests of all ranks. The answer is the status of the lowest rank that is not kOk; else, if
// the digest of a rank is not that of rank 0, `difference`. Collective. Allocates nothing.
Answer agree(MPI_Comm comm, Status status, std::uint64_t digest, Difference difference) noexcept;

}  // namespace cab::mpi
