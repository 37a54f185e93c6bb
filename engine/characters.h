// Steps 1 to 6 of a frame for characters.
#pragma once

#include "engine/engine.h"
#include "engine/report.h"

namespace cab {

// Step 1: poses the leaf boxes of every instance of the inputs' character batches. Stores whether each instance is live
// (not masked), and writes the caller's flags. Stores the world bounds of each instance and fills the histograms for
// the grid. Strategy::kExactAll needs neither bounds nor grid, so it makes no bounds and the grid stays empty.
void bound_characters(const FrameContext& frame, Span<const BatchInput> inputs, Engine& engine);

// Steps 2 to 6, given the built grid: finds candidates, poses them again, tests their boxes, runs the exact test and
// reports hits. Works in spatial order, but in key order with Strategy::kExactAll, in a frame whose hits do not fit
// into the hit store, and in some frames after it.
void pair_characters(const FrameContext& frame, Engine& engine, HitSink& sink);

}  // namespace cab
