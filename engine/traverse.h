// Step 4 of a frame for characters: candidates -> overlapping leaf pairs, with pairs as lanes.
#pragma once

#include "engine/frame_context.h"

namespace cab {

struct Worker;

// Pairs that the traversal's stack may hold for each level of both hierarchies together.
inline constexpr std::uint32_t kStackPairsPerLevel = 32;

// Tests the worker's candidates from `begin` to `end` - 1 and leaves every overlapping leaf pair in worker.found, which has
// room for all their leaf pairs and kLanes more. The pairs stand by candidate, ascending. With strategy links, leaves are
// the boxes of links. Otherwise, where one pair is enough (FrameContext::first_only), the instances of an overlapping
// pair are noted as in contact at once, and candidates that are already reported are tested no further.
void find_leaf_pairs(const FrameContext& frame, std::uint32_t begin, std::uint32_t end, Worker& worker);

}  // namespace cab
