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

// Writes the first hits of a query from what find_overlapped found, in full or as a short list.
template <class Hit>
void write_overlapped(const QueryRun& run, std::uint32_t query, Span<const kernel::MetLeaves> found, Span<Hit> hits) {
  Hit* to = hits.begin();
  for (const kernel::MetLeaves& at : found) {
    const auto slot = static_cast<std::uint32_t>(at.key >> 32);
    const std::uint16_t* const links = run.frame.batch(slot).articulation->leaf_link.data + at.tile * kLanes;
    const auto instance = static_cast<std::uint32_t>(at.key);
    for (std::uint32_t left = at.inside; left; left &= left - 1) {
      if (to == hits.end()) return;
      const std::uint32_t lane = lowest_bit(left);
      const auto leaf = static_cast<std::uint16_t>(at.tile * kLanes + lane);
      Hit& hit = *to++;
      hit = {};
      hit.query = query;
      hit.batch = {slot + 1};
      hit.instance = instance;
      hit.link = links[lane];
      hit.leaf = leaf;
    }
  }
}

}  // namespace cab
