// One rank whose allocations fail, so that the others have to be told.
#pragma once

#include <mpi.h>

namespace cab::tests {

// What operator new of this program gives.
struct Allocations {
  long left = -1;      // how many succeed before one fails; below 0: all succeed
  bool lasts = false;  // whether all that follow fail too
  bool has_failed = false;
};
inline Allocations allocations;

struct Ranks {
  int rank = 0, ranks = 1;
  Ranks() {
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &ranks);
  }
  // The rank whose allocations fail, in the middle.
  int victim() const { return ranks / 2; }
};

// Calls `work` while allocation `nth` of the victim, and perhaps all after it, fail. Returns on all ranks whether one
// failed.
template <class Work>
bool run_short_of_memory(const Ranks& ranks, long nth, bool all_after, Work&& work) {
  allocations = {ranks.rank == ranks.victim() ? nth : -1, all_after, false};
  work();
  allocations.left = -1;
  int failed = allocations.has_failed ? 1 : 0;
  MPI_Bcast(&failed, 1, MPI_INT, ranks.victim(), MPI_COMM_WORLD);
  return failed == 1;
}

}  // namespace cab::tests
