// What the ranks of `cab crowd --mpi` tell each other besides frames.
#pragma once

#include <mpi.h>

#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

namespace cab::perf {

// A failure that all ranks know of. One of them tells it, and all end.
class AgreedFailure : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// All ranks of a program. Calls are collective.
class Ranks {
 public:
  Ranks();
  int rank() const { return rank_; }
  int count() const { return count_; }

  // Throws AgreedFailure on all ranks if some rank has a problem to tell, that of the lowest one.
  void agree(const std::string& problem) const;

  // Calls `work`, and throws AgreedFailure on all ranks if it threw std::exception on one.
  template <class Work>
  void together(Work&& work) const {
    std::string problem;
    try {
      work();
    } catch (const std::exception& error) { problem = error.what(); }
    agree(problem);
  }

  // The text of a rank.
  std::string text_of(int rank, std::string text) const;

  double most(double value) const;

  // The values of all ranks, one rank after the other.
  template <class T>
  std::vector<T> gather(const T* values, std::size_t count, MPI_Datatype type) const {
    const std::vector<int> counts = counts_of(count);
    std::vector<int> offsets;
    int sum = 0;
    for (const int one : counts) {
      offsets.push_back(sum);
      sum += one;
    }
    std::vector<T> out(static_cast<std::size_t>(sum));
    MPI_Allgatherv(values, static_cast<int>(count), type, out.data(), counts.data(), offsets.data(), type,
                   MPI_COMM_WORLD);
    return out;
  }

 private:
  std::vector<int> counts_of(std::size_t count) const;
  int rank_ = 0, count_ = 1;
};

}  // namespace cab::perf
