// Leaf pairs by strategy `links`: from links whose boxes overlap to their overlapping leaves. The other instance of a
// candidate may have another strategy: its boxes are those of leaves, one each.
#pragma once

#include "engine/step/candidate.h"
#include "engine/step/frame_context.h"
#include "layout/box_aos.h"
#include "layout/pair_list.h"

namespace cab {

struct PairScratch;

// Where the posed leaves of one link of one instance start. Valid while `generation` equals that of the set.
struct PosedLinkEntry {
  std::uint32_t generation;
  std::uint32_t first;  // index into PosedLinkSet::boxes, a multiple of kLanes
};

// The posed leaves of links whose boxes overlap those of other links. A link is posed when it is first needed.
struct PosedLinkSet {
  FixedList<BoxAos> boxes;       // each link takes whole tiles, and lanes past its last leaf are unused
  FixedList<float> leaf_bounds;  // per link, at six times the index of its first box (layout/leaf_bounds_soa.h)
  Span<PosedLinkEntry> entries;  // by the index of the link's box in PosedSet::boxes
  std::uint32_t generation = 1;
};

// Capacity of PosedLinkSet::boxes. At least two links fit, however many leaves they have.
inline constexpr std::uint32_t kPosedLinkLeaves = 4096;
static_assert(kPosedLinkLeaves >= 2 * kMaxLeaves);

// Finds the overlapping leaf pairs of a candidate, whose link pairs with overlapping boxes are `links`, and leaves them
// in scratch.found. With Exact::kNone only the lowest leaf pair of each link pair is listed. With
// FrameContext::first_only the search ends at the first leaf pair, which marks both instances as in contact.
void find_pairs_of_links(const FrameContext& frame, const Candidate& candidate, Span<const LeafPair> links,
                         PairScratch& scratch, FrameStats& stats);

// Removes all links from the set.
void clear_links(PosedLinkSet& set);

}  // namespace cab
