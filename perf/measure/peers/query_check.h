// How right the answers of a set-up are, by the judge of perf/judge/oracle/query_judge.h.
#pragma once

#include <cstdint>
#include <vector>

#include "perf/judge/oracle/query_judge.h"
#include "perf/measure/peers/query_world.h"
#include "scenes/crowd/crowd.h"

namespace cab::perf {

// What a query may find, and what it must.
struct JudgedQuery {
  double nearest = kNoHit;        // the distance of the nearest leaf; kNoHit: there is none
  double nearest_least = kNoHit;  // of the nearest leaf that has grown to the threshold
  double nearest_most = kNoHit;   // of the nearest that has shrunk to it
  std::uint32_t leaf = 0;         // the nearest
  // Sorted: the leaves that the query meets, and those when all have grown or shrunk to the threshold.
  std::vector<std::uint32_t> exact, grown, shrunk;
};

// A posed crowd before the judge. Memory: some 2 KB per leaf.
class QueryCheck {
 public:
  QueryCheck(const scenes::Crowd& crowd, const std::vector<scenes::PosedGroup>& posed);

  // Judges a query by brute force over all leaves. within: of a point, the distance of leaves that are looked at.
  JudgedQuery judge(Query query, float within) const;

 private:
  CrowdLeaves leaves_;
  oracle::QueryScene exact_, grown_, shrunk_;
};

// How a set-up's answers differ from the judge's.
struct QueryDifferences {
  std::uint64_t queries = 0;     // that were judged
  std::uint64_t hits = 0;        // that it reported
  std::uint64_t misses = 0;      // rays, points: the nearest leaf was lost; spheres: leaves that were
  std::uint64_t false_hits = 0;  // what is reported is not met
  std::uint64_t inexact = 0;     // the distance is less than that of any leaf that is met
  std::uint64_t threshold = 0;   // differs, where float cannot decide
  std::uint64_t not_inside = 0;  // rays that begin in a leaf, and do not say so
  double largest_error = 0;      // of the distances that are none of these but inexact, in metres

  bool is_right() const { return misses == 0 && false_hits == 0 && inexact == 0; }
  // cab also says of a ray that begins in a leaf that it does.
  bool is_ours_right() const { return is_right() && not_inside == 0; }
};

// Adds the answer to query `index`. Overlaps must be sorted.
void add_differences(const JudgedQuery& judged, QueryKind kind, const Answers& answers, std::uint32_t index,
                     QueryDifferences& found);

// The sorted overlaps of one query.
Span<const Overlap> overlaps_of(const Answers& answers, std::uint32_t index);

}  // namespace cab::perf
