// Steps 5 and 6 of a frame: overlapping leaf pairs -> exact tests -> the caller's sorted hits.
#pragma once

#include "engine/engine.h"

#include <atomic>

namespace cab {

// Where hits go: the caller's buffer, and how many were found so far (which may be more than it holds).
struct HitSink {
  FrameJob* job;
  std::atomic<std::size_t> found{0};
};

// Confirms leaf pairs of one candidate by the exact policy and reports one hit a touching link pair, the lowest
// touching leaf pair kept. Reorders the pairs.
void report_candidate(const Engine& engine, const Candidate& candidate, Span<LeafPair> pairs, Worker& worker,
                      HitSink& sink);

// Sorts the hits that were found and, where the caller wants contacts, asks for them. kHitsOverflow when the buffer
// was too small.
Status finish_hits(const Engine& engine, HitSink& sink);

}  // namespace cab
