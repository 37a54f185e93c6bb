// Steps 5 and 6 of a frame: overlapping leaf pairs -> exact tests -> the caller's sorted hits.
#pragma once

#include "engine/engine.h"

#include <atomic>

namespace cab {

// Where hits go: the caller's buffer, and how many were found so far (which may be more than it holds). Tasks that follow
// the order of hits hand theirs over in turn, so that hits stand in the order of tasks whoever ran them. Tasks that
// follow the spatial order of characters put them into the engine's store, from which they are written in order at the end.
struct HitSink {
  FrameJob* job;
  std::atomic<std::size_t> found{0};
  std::atomic<std::uint32_t> turn{0};  // the task whose hits come next
  bool sorted = true;                  // hits stand in the order that the caller was promised
  bool in_spatial_order = false;
  std::atomic<std::uint64_t> stored_words{0};
  std::atomic<bool> store_full{false};
};

// Confirms leaf pairs of one candidate by the exact policy and keeps one hit a touching link pair in worker.hits, the
// lowest touching leaf pair kept; with Report::kInContact only whether there is one. Reorders the pairs. task: the one that
// the worker runs.
void report_candidate(Engine& engine, const Candidate& candidate, Span<LeafPair> pairs, std::uint32_t task,
                      Worker& worker, HitSink& sink);

// Hands over the hits of a task when its turn has come, and passes the turn on.
void finish_task(std::uint32_t task, Worker& worker, HitSink& sink);

// Puts the hits that a worker has into the store, all of one instance at once. Sets store_full if there is no room.
void store_hits(Engine& engine, Worker& worker, HitSink& sink);

// Writes all hits of the store to the caller's buffer, in order.
void write_stored_hits(Engine& engine, HitSink& sink);

// Sorts the hits that were found, if they do not stand sorted, and, where the caller wants contacts, asks for them.
// kHitsOverflow when the buffer was too small.
Status finish_hits(const Engine& engine, HitSink& sink);

}  // namespace cab
