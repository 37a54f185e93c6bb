// The frame of a crowd: characters whose leaves are rigid boxes, paired by their leaf bounds (Strategy::kRows).
//
// Every instance is bounded once, straight from its pose. What is kept of it are the compact words of its leaves and
// the six sides of its bounds. Strips sorted by these sides find the candidates; their words are compared in blocks;
// and the poses of the leaves that are left are read again inside the box test. Hits are those of the other frame
// (engine/characters.h), which takes whatever this one does not.
#pragma once

#include "engine/frame_run.h"

namespace cab {

// Decides whether this frame takes the job's characters (FrameRun::by_crowd). If so, bounds every instance. By bands,
// nearly all rows are sorted and paired in the same tasks.
std::uint32_t begin_bounding_crowd(FrameRun& run);
void bound_crowd(FrameRun& run, std::uint32_t task, std::uint32_t worker);

// Sorts the rows into strips; by bands the strays alone.
std::uint32_t begin_sorting_crowd(FrameRun& run);
void sort_crowd(FrameRun& run, std::uint32_t task, std::uint32_t worker);

// Finds and tests the candidates, and stores their hits.
std::uint32_t begin_pairing_crowd(FrameRun& run);
void pair_crowd(FrameRun& run, std::uint32_t task, std::uint32_t worker);

// Keeps the order for the next frame. If the hits did not fit into the store, gives the frame up to the other one.
std::uint32_t end_crowd(FrameRun& run);

}  // namespace cab
