// Step 4 of a frame for characters: candidate pairs -> overlapping leaf pairs, with pairs as lanes.
#pragma once

#include "engine/engine.h"

namespace cab {

// Pairs that the traversal's stack may hold for each level of both hierarchies together.
inline constexpr std::uint32_t kStackPairsPerLevel = 32;

// Tests worker.candidates (each between two instances, or each within one) and leaves every overlapping leaf pair
// in worker.found, slot = index of the candidate. All candidates of a call have the same kind.
void traverse_candidates(const Engine& engine, const Policies& policies, bool within, Worker& worker);

}  // namespace cab
