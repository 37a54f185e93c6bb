// Step 4 of a frame for strategy links: from links whose boxes overlap to their leaves, which are posed only now.
#pragma once

#include "engine/engine.h"

namespace cab {

// Lists in worker.found the overlapping leaf pairs of a candidate's links, whose boxes overlap. only_first: the lowest
// leaf pair of every two links is enough; first_only: whether any overlap is, which is noted.
void find_pairs_of_links(const Engine& engine, float margin, const Candidate& candidate, Span<const LeafPair> links,
                         bool only_first, bool first_only, Worker& worker);

// Drops what is posed of links.
void clear_links(Worker& worker);

}  // namespace cab
