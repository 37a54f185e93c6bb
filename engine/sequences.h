// All steps of a frame for sequences: lanes are frames, so a tile of all sequences is updated and tested at once.
#pragma once

#include "engine/engine.h"
#include "engine/report.h"

namespace cab {

// Runs every rule that pairs sequences, a tile of 16 frames at a time while it is in cache.
void run_sequences(const FrameContext& frame, const FrameJob& job, Engine& engine, HitSink& sink);

}  // namespace cab
