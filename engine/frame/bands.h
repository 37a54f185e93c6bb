// The crowd's frame by bands: strips are bounded, sorted and paired one after the other, while their instances are in
// cache (CrowdBands).
#pragma once

#include "engine/frame/frame_run.h"

namespace cab {

// Whether this frame can go by the strips of the last one. If so, makes room for its rows in them.
bool begin_bands(FrameRun& run);

// Bounds, sorts and pairs the strips of one chunk.
void run_band_task(FrameRun& run, std::uint32_t task, std::uint32_t worker);

// Pairs the strips on both sides of the seam after a chunk.
void pair_seam(FrameRun& run, std::uint32_t chunk, std::uint32_t worker);

// After the first pass of all chunks: puts the strays into strips of their own, unsorted. Returns false if there are
// too many; then the rows are there, and all of them have yet to be paired.
bool end_bands(FrameRun& run);

// After the frame: keeps the order for the next one, and says whether that can go by bands.
void keep_order(Engine& engine);

}  // namespace cab
