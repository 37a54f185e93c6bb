// The step `contacts` of a frame: the contacts of hits, and the hits that are dropped because of them.
#pragma once

#include "engine/exact/exact.h"
#include "engine/frame/frame_run.h"

namespace cab {

// How many tasks take kContactsPerTask hits each.
inline std::uint32_t contact_tasks(std::size_t hits) {
  return static_cast<std::uint32_t>((hits + kContactsPerTask - 1) / kContactsPerTask);
}

// Sorts the hits, and fills FrameJob::contacts unless it is empty. Marks hits that are not as deep as
// FrameJob::min_depth.
std::uint32_t begin_contacts(FrameRun& run);
void add_contacts(FrameRun& run, std::uint32_t task, std::uint32_t worker);

// Drops the marked hits, and with Report::kDistances all but the nearest links of two instances; then sets
// FrameJob::hit_count and the in_contact bytes anew.
void drop_hits(FrameRun& run);

}  // namespace cab
