// From candidates to overlapping leaf pairs, sixteen pairs of boxes per kernel call.
#pragma once

#include "engine/step/frame_context.h"

namespace cab {

struct PairScratch;

// Capacity of PairScratch::stack: this many pairs per level, for as many levels as both hierarchies have together.
// traverse() in traverse.cpp says why that suffices.
inline constexpr std::uint32_t kStackPairsPerLevel = 32;

// Tests the candidates from `begin` to `end` - 1 and leaves their overlapping leaf pairs in scratch.found, sorted by
// candidate. scratch.found must have room for all leaf pairs of these candidates and kLanes more. The leaves
// of an instance with strategy `links` are its link boxes. Without them and with FrameContext::first_only, the first
// overlapping leaf pair of a candidate marks both instances as in contact at once, and a candidate whose instances are
// already reported is not tested.
void find_leaf_pairs(const FrameContext& frame, std::uint32_t begin, std::uint32_t end, PairScratch& scratch,
                     FrameStats& stats);

}  // namespace cab
