#include "perf/measure/crowd/ranks.h"

#include <cstddef>

namespace cab::perf {

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

std::vector<int> Ranks::counts_of(std::size_t count) const {
  const int own = static_cast<int>(count);
  std::vector<int> out(static_cast<std::size_t>(count_));
  MPI_Allgather(&own, 1, MPI_INT, out.data(), 1, MPI_INT, MPI_COMM_WORLD);
  return out;
}

}  // namespace cab::perf
