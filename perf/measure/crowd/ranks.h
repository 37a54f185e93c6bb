// What the ranks of `cab crowd --mpi` tell each other besides frames.
#pragma once

#include "perf/base/out_of_memory.h"

#include <mpi.h>

#include <cstddef>
#include <cstdint>
#include <new>
#include <stdexcept>
#include <string>
#include <vector>

namespace cab::perf {

// A failure that all ranks know of. One of them tells it, and all end.
class AgreedFailure : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// How many values each rank has, and where they begin among those of all, as MPI takes them.
struct Layout {
  std::vector<int> counts, begins;
  std::size_t sum = 0;
};
// Throws std::runtime_error if there are more values than MPI counts.
Layout layout_of(const std::vector<std::uint64_t>& counts);

// All ranks of a program. Calls are collective.
class Ranks {
 public:
  Ranks();
  int rank() const { return rank_; }
  int count() const { return count_; }

  // Throws AgreedFailure on all ranks if some rank has a problem to tell, that of the lowest one.
  void agree(const std::string& problem) const;

  // Calls `work`, which calls nothing collective, since a rank in which it throws leaves it before the others. Throws
  // AgreedFailure on all ranks if it threw std::exception on one.
  template <class Work>
  void together(Work&& work) const {
    std::string problem;
    try {
      work();
    } catch (const std::bad_alloc&) { problem = out_of_memory(); } catch (const std::exception& error) {
      problem = error.what();
    }
    agree(problem);
  }

  // The text of a rank.
  std::string text_of(int rank, std::string text) const;

  double most(double value) const;

  // The values of all ranks, one rank after the other. Throws AgreedFailure on all ranks if one has no memory for them,
  // or if they are more than MPI counts.
  template <class T>
  std::vector<T> gather(const T* values, std::size_t count, MPI_Datatype type) const {
    std::vector<std::uint64_t> all;
    together([&] { all.resize(static_cast<std::size_t>(count_)); });
    const std::uint64_t own = count;
    MPI_Allgather(&own, 1, MPI_UINT64_T, all.data(), 1, MPI_UINT64_T, MPI_COMM_WORLD);
    Layout layout;
    std::vector<T> out;
    together([&] {
      layout = layout_of(all);
      out.resize(layout.sum);
    });
    MPI_Allgatherv(values, static_cast<int>(count), type, out.data(), layout.counts.data(), layout.begins.data(), type,
                   MPI_COMM_WORLD);
    return out;
  }

 private:
  int rank_ = 0, count_ = 1;
};

}  // namespace cab::perf
