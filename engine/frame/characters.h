// The steps of a frame for characters.
//
// Every instance is bounded once. What is kept of it are the six sides of its bounds, and where its leaves are rigid
// boxes that are paired by their bounds, the compact words of these (InstanceBatch::by_words). Strips sorted by the
// sides find the candidates. Those of two instances with words are tested by words, and the poses of the leaves that
// are left are read again inside the box test (engine/frame/crowd_tester.h). All others are posed once more and tested
// as their strategies say (engine/frame/posed_tester.h).
#pragma once

#include "engine/frame/frame_run.h"

namespace cab {

// Step `bound`: bounds every instance of the inputs' batches of characters that does not rest. Stores whether each
// instance is live (not masked), and writes the caller's flags. By bands, nearly all rows are sorted and paired in the
// same tasks.
std::uint32_t begin_bounding(FrameRun& run);
void bound_characters(FrameRun& run, std::uint32_t task, std::uint32_t worker);

// Step `sort`: sorts the rows into strips; by bands the strays alone.
std::uint32_t begin_sorting(FrameRun& run);
void sort_characters(FrameRun& run, std::uint32_t task, std::uint32_t worker);

// Step `pair`: finds and tests the candidates, and stores their hits.
std::uint32_t begin_pairing(FrameRun& run);
void pair_characters(FrameRun& run, std::uint32_t task, std::uint32_t worker);

// Keeps the order of the rows for the next frame.
std::uint32_t end_pairing(FrameRun& run);

}  // namespace cab
