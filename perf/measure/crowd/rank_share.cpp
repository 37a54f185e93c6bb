#include "perf/measure/crowd/rank_share.h"

#include <cab/mpi.h>

#include <algorithm>
#include <cstddef>

#include "perf/base/engine_call.h"

namespace cab::perf {
namespace {

// How many characters are posed at a time only to see where they are.
constexpr std::uint32_t kPosedAtATime = 4096;

}  // namespace

RankShare::RankShare(const scenes::Crowd& crowd, const Ranks& ranks)
    : crowd_(crowd), ranks_(ranks), numbers_(crowd.groups.size()), posed_(crowd.groups.size()) {}

void RankShare::cut(double seconds) {
  std::vector<double> own;
  ranks_.together([&] { own = places_of_part(seconds); });
  const std::vector<double> places = ranks_.gather(own.data(), own.size(), MPI_DOUBLE);
  ranks_.together([&] { take(places); });
}

std::vector<double> RankShare::places_of_part(double seconds) const {
  // Characters count through all groups here.
  const auto rank = static_cast<std::uint64_t>(ranks_.rank()), ranks = static_cast<std::uint64_t>(ranks_.count());
  const std::uint64_t all = crowd_.count();
  const std::uint64_t begin = all * rank / ranks, end = all * (rank + 1) / ranks;
  std::vector<double> own;
  std::vector<std::uint32_t> chosen;
  scenes::PosedGroup posed;
  std::uint64_t first = 0;
  for (const scenes::CrowdGroup& group : crowd_.groups) {
    const std::uint64_t group_end = first + group.count;
    for (std::uint64_t at = std::max(begin, first); at < std::min(end, group_end);) {
      const std::uint64_t next = std::min({at + kPosedAtATime, end, group_end});
      chosen.clear();
      for (; at < next; ++at) chosen.push_back(static_cast<std::uint32_t>(at - first));
      group.pose(seconds, scenes::Chosen::of(chosen), posed);
      own.insert(own.end(), posed.origins.begin(), posed.origins.end());
    }
    first = group_end;
  }
  return own;
}

void RankShare::take(const std::vector<double>& places) {
  std::vector<std::int32_t> owners(places.size() / 3);
  require(mpi::cut(places, ranks_.count(), owners), "cut");
  std::size_t at = 0;
  for (std::size_t g = 0; g < crowd_.groups.size(); ++g) {
    numbers_[g].clear();
    for (std::uint32_t i = 0; i < crowd_.groups[g].count; ++i)
      if (owners[at++] == ranks_.rank()) numbers_[g].push_back(i);
  }
}

void RankShare::pose(double seconds) {
  for (std::size_t g = 0; g < numbers_.size(); ++g)
    crowd_.groups[g].pose(seconds, scenes::Chosen::of(numbers_[g]), posed_[g]);
}

std::uint64_t RankShare::count() const {
  std::uint64_t sum = 0;
  for (const std::vector<std::uint32_t>& numbers : numbers_) sum += numbers.size();
  return sum;
}

}  // namespace cab::perf
