// Steps 1 to 6 of a frame for all batches of characters.
#pragma once

#include "engine/engine.h"
#include "engine/report.h"

namespace cab {

// Step 1: bounds every instance of the inputs, by posing its leaves, and says who is masked.
void bound_characters(const FrameContext& frame, Span<const BatchInput> inputs, Engine& engine);

// Steps 2 to 6: finds candidates in the grid, poses them, tests their boxes, confirms what overlaps and reports hits. In
// spatial order, or in key order where the store of hits would be too small.
void pair_characters(const FrameContext& frame, Engine& engine, HitSink& sink);

}  // namespace cab
