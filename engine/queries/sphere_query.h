// Spheres that ask which links they overlap, without depths and shapes: leaves are found as bits, and become hits only
// where these are written.
#pragma once

#include "engine/queries/search.h"

namespace cab {

// Whether a query is answered so. Links must have one leaf each, in the order of links.
inline bool is_answered_by_bits(const QueryRun& run, const Query& query) {
  return run.links_are_leaves && query.kind == QueryKind::kSphere && query.time == kNow && !query.with_depth &&
         run.job.exact == Exact::kNone;
}

// Finds the leaves of the job's inputs that a sphere overlaps, in the order of hits: as bits of `inside`, of which one
// at least is set. They are in the worker's memory, until it finds others. If the query wants no link by name, one is
// enough.
Span<const kernel::MetLeaves> find_overlapped(const QueryRun& run, const Query& query);

// Writes the first hits of a query from what find_overlapped found.
void write_overlapped(const QueryRun& run, std::uint32_t query, Span<const kernel::MetLeaves> found,
                      Span<QueryHit> hits);

}  // namespace cab
