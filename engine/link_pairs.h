// Step 4 of a frame for strategy links: from links whose boxes overlap to their leaves, which are posed only now.
#pragma once

#include "engine/engine.h"

namespace cab {

// Lists in worker.found the overlapping leaf pairs of a candidate's links, whose boxes overlap: the lowest of every two
// links alone where nothing exact may deny it. first_only: whether any overlap is enough; it is noted.
void find_pairs_of_links(const Engine& engine, const Policies& policies, float margin, const Candidate& candidate,
                         Span<const LeafPair> links, bool first_only, Worker& worker);

// Drops what is posed of links.
void clear_links(Worker& worker);

}  // namespace cab
