// The step `sequences` of a frame: one task takes the same tile of every sequence, sixteen animation frames as lanes,
// from its poses to its hits.
#pragma once

#include "engine/frame/frame_run.h"

namespace cab {

// All rules between and within sequences, one task per tile, taken in turn. The boxes of a tile stay in cache from
// posing to testing.
std::uint32_t begin_sequences(FrameRun& run);
void run_sequence_tile(FrameRun& run, std::uint32_t task, std::uint32_t worker);

}  // namespace cab
