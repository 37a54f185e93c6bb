// One rank's share of a crowd: who it has, and their poses.
#pragma once

#include <cstdint>
#include <vector>

#include "perf/measure/crowd/ranks.h"
#include "scenes/crowd/crowd.h"

namespace cab::perf {

class RankShare {
 public:
  RankShare(const scenes::Crowd& crowd, const Ranks& ranks);

  // Cuts the crowd anew, by where everyone is at a time. Each rank poses an equal part of the crowd for that.
  // Collective. Throws AgreedFailure.
  void cut(double seconds);

  // Poses those that this rank has.
  void pose(double seconds);

  // By group: the numbers of the characters, ascending, and their poses.
  const std::vector<std::uint32_t>& numbers(std::size_t group) const { return numbers_[group]; }
  const scenes::PosedGroup& posed(std::size_t group) const { return posed_[group]; }
  std::uint64_t count() const;

 private:
  // x y z of everyone in this rank's equal part.
  std::vector<double> places_of_part(double seconds) const;
  // Takes this rank's characters, by the places of all.
  void take(const std::vector<double>& places);

  const scenes::Crowd& crowd_;
  const Ranks& ranks_;
  std::vector<std::vector<std::uint32_t>> numbers_;
  std::vector<scenes::PosedGroup> posed_;
};

}  // namespace cab::perf
