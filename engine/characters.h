// Steps 1 to 6 of a frame for characters.
#pragma once

#include "engine/frame_run.h"

namespace cab {

// Step 1: poses the leaf boxes of every instance of the inputs' character batches that does not rest. Stores whether
// each instance is live (not masked), and writes the caller's flags. Stores the world bounds of each instance and fills
// the histograms for the grids.
std::uint32_t begin_bounding(FrameRun& run);
void bound_characters(FrameRun& run, std::uint32_t task, std::uint32_t worker);

// Steps 2 to 6, given the built grids: finds candidates, poses them again, tests their boxes, runs the exact test and
// stores the hits, in spatial order. Without tasks in a frame in key order. After its tasks, end_spatial_order drops
// the hits and counts if they did not fit into the store: then the frame is paired in key order, as some frames after
// it are.
std::uint32_t begin_spatial_order(FrameRun& run);
void pair_in_spatial_order(FrameRun& run, std::uint32_t task, std::uint32_t worker);
void end_spatial_order(FrameRun& run);

// The same in key order. Tasks append their hits to the caller's buffer in turn.
std::uint32_t begin_key_order(FrameRun& run);
void pair_in_key_order(FrameRun& run, std::uint32_t task, std::uint32_t worker);

// Steps 5 and 6 for the candidates of a worker whose leaf pairs are in worker.found, sorted by candidate.
void report_leaves(const FrameContext& frame, Worker& worker, HitSink& sink);

}  // namespace cab
