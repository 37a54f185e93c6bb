// Which batches of characters the rules of a frame pair with each other.
#pragma once

#include "engine/step/frame_context.h"

namespace cab {

// Records the rules of characters in their batches and in `out`.
void note_rules(Span<const PairRule> rules, StoredBatches batches, PairedBatches& out);

}  // namespace cab
