#include "perf/measure/crowd/ranks.h"

#include <limits>
#include <numeric>

namespace cab::perf {

Layout layout_of(const std::vector<std::uint64_t>& counts) {
  constexpr std::uint64_t kMost = std::numeric_limits<int>::max();
  const std::uint64_t sum = std::accumulate(counts.begin(), counts.end(), std::uint64_t{0});
  if (sum > kMost)
    throw std::runtime_error("all ranks together have " + std::to_string(sum) + " numbers to tell, and MPI counts to " +
                             std::to_string(kMost));
  Layout out;
  for (const std::uint64_t count : counts) {
    out.begins.push_back(static_cast<int>(out.sum));
    out.counts.push_back(static_cast<int>(count));
    out.sum += count;
  }
  return out;
}

Ranks::Ranks() {
  MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
  MPI_Comm_size(MPI_COMM_WORLD, &count_);
}

void Ranks::agree(const std::string& problem) const {
  const int own = problem.empty() ? count_ : rank_;
  int lowest = count_;
  MPI_Allreduce(&own, &lowest, 1, MPI_INT, MPI_MIN, MPI_COMM_WORLD);
  if (lowest == count_) return;
  throw AgreedFailure("rank " + std::to_string(lowest) + ": " + text_of(lowest, problem));
}

std::string Ranks::text_of(int rank, std::string text) const {
  auto size = static_cast<unsigned long long>(text.size());
  MPI_Bcast(&size, 1, MPI_UNSIGNED_LONG_LONG, rank, MPI_COMM_WORLD);
  text.resize(size);
  MPI_Bcast(text.data(), static_cast<int>(size), MPI_CHAR, rank, MPI_COMM_WORLD);
  return text;
}

double Ranks::most(double value) const {
  double out = 0;
  MPI_Allreduce(&value, &out, 1, MPI_DOUBLE, MPI_MAX, MPI_COMM_WORLD);
  return out;
}

}  // namespace cab::perf
