// Rays about the past that want the first leaf box, or any: many are searched for together.
#pragma once

#include "engine/queries/search.h"

namespace cab {

// Whether a query is such a ray.
inline bool is_past_ray(const QueryRun& run, const Query& query) {
  return query.kind == QueryKind::kRay && query.time != kNow && query.want != QueryWant::kAll &&
         run.job.exact == Exact::kNone;
}

// Searches the job's histories for some of them, up to HistoryMemory::kMostRays, whose PastRay::query is set. Finds the
// leaves that each may meet first, for RayQuery::finish, unless there are too many.
void search_past(const QueryRun& run, PastRay* const* rays, std::uint32_t count);

}  // namespace cab
