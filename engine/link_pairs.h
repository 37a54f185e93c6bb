// Step 4 of a frame for characters by strategy links, from links whose boxes overlap to their leaves.
#pragma once

#include "engine/candidate.h"
#include "engine/frame_context.h"
#include "layout/box_aos.h"
#include "layout/pair_list.h"

namespace cab {

struct Worker;

// Where the leaves of one link of one instance stand, valid while `generation` is the set's.
struct PosedLinkEntry {
  std::uint32_t generation;
  std::uint32_t first;  // padded to whole tiles
};

// Leaves of the links whose boxes overlap those of another, posed when they are first asked for.
struct PosedLinkSet {
  FixedList<BoxAos> boxes;
  FixedList<float> leaf_bounds;  // layout/leaf_bounds_soa.h, six floats per box
  Span<PosedLinkEntry> entries;  // by the index of the link's box in the PosedSet
  std::uint32_t generation = 1;
};

// Leaves, padded to whole tiles, that a worker's posed links hold: two links of the most leaves at least.
inline constexpr std::uint32_t kPosedLinkLeaves = 4096;
static_assert(kPosedLinkLeaves >= 2 * kMaxLeaves);

// Lists in worker.found the overlapping leaf pairs of a candidate's links, whose boxes overlap. With Exact::kNone only the
// lowest leaf pair of each link pair is listed. Where the first pair is enough (FrameContext::first_only) it ends the
// search, and both instances are noted as in contact.
void find_pairs_of_links(const FrameContext& frame, const Candidate& candidate, Span<const LeafPair> links,
                         Worker& worker);

// Drops what is posed of links.
void clear_links(PosedLinkSet& set);

}  // namespace cab
