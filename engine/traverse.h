// Step 4 of a frame for characters: candidate pairs -> overlapping leaf pairs, with pairs as lanes.
#pragma once

#include "engine/engine.h"

namespace cab {

// Pairs that the traversal's stack may hold for each level of both hierarchies together.
inline constexpr std::uint32_t kStackPairsPerLevel = 32;

// Tests the worker's candidates from `begin` to `end` - 1 (each between two instances, or within one) and leaves every
// overlapping leaf pair in worker.found, which has room for all their leaf pairs and kLanes more; candidate = index of the
// candidate, ascending. first_only: one pair settles a candidate; it is noted as
// in contact at once, and candidates that are already reported are tested no further.
void find_leaf_pairs(const Engine& engine, const Policies& policies, bool first_only, std::uint32_t begin,
                     std::uint32_t end, Worker& worker);

}  // namespace cab
