// Steps 1 to 6 of a frame for sequences: one task takes the same tile of every sequence, sixteen animation frames as
// lanes, through all steps.
#pragma once

#include "engine/engine.h"
#include "engine/report.h"

namespace cab {

// Tests all rules between and within sequences, one task per tile. The boxes of a tile stay in cache from posing to
// testing.
void run_sequences(const FrameContext& frame, const FrameJob& job, Engine& engine, HitSink& sink);

}  // namespace cab
