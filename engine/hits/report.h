// Reports candidates: the exact test on overlapping leaf pairs, and the hits of those that touch.
#pragma once

#include "engine/hits/hit_store.h"
#include "engine/step/frame_context.h"
#include "layout/pair_list.h"

#include <atomic>

namespace cab {

struct Candidate;

// Capacity of HitScratch::hits. A worker empties it when it is full, so a task may find more hits.
inline constexpr std::uint32_t kTaskHits = 4096;

// What a worker needs to report hits.
struct HitScratch {
  FixedList<Hit> hits;  // sequences: hits that are not in the caller's buffer yet
  HitBlock block;       // characters: where their hits go
};

// Where the hits of a frame go. Those of characters go into the store, from which they are written in key order at the
// end. Those of sequences are appended to the caller's buffer as tasks find them, and sorted at the end.
struct HitSink {
  FrameJob* job;
  HitStore* store;
  std::atomic<std::uint64_t> found{0};        // number of hits counted for the caller's buffer; may exceed its size
  bool sorted = true;                         // whether the hits in the buffer are already in the promised order
  bool alone = false;                         // whether one thread runs all tasks
  std::atomic<std::uint64_t> stored_hits{0};  // of the blocks that are full
  std::atomic<bool> out_of_memory{false};     // whether hits were lost since the store could not grow
};

// Runs the exact test on the overlapping leaf pairs of a candidate. Adds one hit per touching link pair, with the
// lowest touching leaf pair, to the store, or to scratch.hits for sequences. With Report::kInContact only marks both
// instances as in contact if any leaf pair touches. May reorder `pairs`.
void report_candidate(const FrameContext& frame, const Candidate& candidate, Span<LeafPair> pairs, HitScratch& scratch,
                      FrameStats& stats, HitSink& sink);

// Appends hits to the caller's buffer, as far as it has room, counts them all, and empties the list.
void append_hits(FixedList<Hit>& hits, HitSink& sink);

// Sorts hits in the promised order.
void sort_hits(Span<Hit> hits);

// Ends the search for hits: sets FrameJob::hit_count and hits_needed, and sorts the hits if they are not sorted yet. If
// the caller's buffer was too small, hit_count is 0.
void finish_hits(HitSink& sink);

}  // namespace cab
