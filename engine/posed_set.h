// Step 3 of a frame for characters: the boxes of the instances that a worker is about to test. Nothing of them is kept
// for all instances: what is posed here stays in cache until its pairs are tested, and an instance that is
// tested against nothing is never refitted.
#pragma once

#include "engine/engine.h"

namespace cab {

// Whether a strategy compares leaf bounds by rows: of links, it does with the boxes of links first.
inline bool uses_leaf_bounds(Strategy strategy) { return strategy == Strategy::kRows || strategy == Strategy::kLinks; }

// Rows of one tile by the strategy at hand: of all nodes where it descends, else of the leaves.
inline std::uint32_t boxes_made(const Articulation& articulation, const Policies& policies) {
  return policies.strategy == Strategy::kTree ? articulation.node_count : articulation.leaf_count;
}

// Whether both instances of a candidate fit.
bool has_room(const Engine& engine, const Candidate& candidate, Worker& worker);

// The slot of an instance, which joins the set if it is not in it; room must be left.
std::uint32_t acquire_slot(const Engine& engine, const Policies& policies, std::uint32_t batch, std::uint32_t instance,
                           const Placement& placement, Worker& worker);

// Poses every instance of the set, and refits those whose strategy descends.
void pose_set(const Engine& engine, const Policies& policies, float margin, Worker& worker);

// Empties the set.
void clear_set(Worker& worker);

}  // namespace cab
