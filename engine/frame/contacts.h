// Step 6 of a frame: the contacts of hits, and the hits that are dropped because of them.
#pragma once

#include "engine/frame/frame_run.h"

namespace cab {

// Whether the results of a job depend on contacts.
bool needs_contacts(const FrameJob& job);

// Sorts the hits, and fills FrameJob::contacts unless it is empty. Marks hits that are not as deep as
// FrameJob::min_depth.
std::uint32_t begin_contacts(FrameRun& run);
void add_contacts(FrameRun& run, std::uint32_t task, std::uint32_t worker);

// Drops the marked hits, and with Report::kDistances all but the nearest links of two instances; then sets
// FrameJob::hit_count and the in_contact bytes anew.
void drop_hits(FrameRun& run);

// Whether the pose of a link and the orientation of its instance are finite, in range and rigid.
bool is_valid_pose(const InstanceBatch& batch, std::uint32_t instance, std::uint32_t link);

// Writes contacts[i] for pairs[i]. Those of a link with an invalid pose have depth minus infinity, and 0 else.
void measure_pairs(const FrameContext& frame, WorkerPool& pool, Span<const Hit> pairs, Contact* contacts);

// Calls visit(a, b) for each leaf on the first link of a hit with each leaf on the second: a ascending, then b.
template <class Visit>
void for_each_leaf_pair(const FrameContext& frame, const Hit& hit, Visit&& visit) {
  const std::uint32_t batch_a = hit.batch_a.value - 1, batch_b = hit.batch_b.value - 1;
  const Span<const std::uint16_t> leaves_a = leaves_of(*frame.batch(batch_a).articulation, hit.link_a),
                                  leaves_b = leaves_of(*frame.batch(batch_b).articulation, hit.link_b);
  for (const std::uint16_t a : leaves_a)
    for (const std::uint16_t b : leaves_b)
      visit(frame.exact_leaf(batch_a, hit.instance_a, a), frame.exact_leaf(batch_b, hit.instance_b, b));
}

}  // namespace cab
