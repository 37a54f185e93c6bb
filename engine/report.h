// Steps 5 and 6 of a frame: runs the exact test on overlapping leaf pairs, and writes hits and contacts.
#pragma once

#include "engine/frame_context.h"
#include "engine/hit_store.h"
#include "layout/pair_list.h"

#include <atomic>

namespace cab {

struct Candidate;
struct Worker;

// Where the hits of a frame go. Tasks in key order append to the caller's buffer in task order, whichever thread ran
// them. Tasks in spatial order put their hits into the store, from which they are written in key order at the end.
struct HitSink {
  FrameJob* job;
  HitStore* store;
  std::atomic<std::size_t> found{0};           // number of hits counted for the caller's buffer; may exceed its size
  std::atomic<std::uint32_t> next{0};          // key order and sequences: index of the task that begins next
  std::atomic<std::uint32_t> turn{0};          // index of the task whose hits are appended next
  bool sorted = true;                          // whether the hits in the buffer are already in the promised order
  bool alone = false;                          // whether one thread runs all tasks
  bool in_spatial_order = false;               // whether tasks put their hits into the store at present
  std::atomic<std::uint64_t> stored_words{0};  // words of the store that are taken; may exceed its size
  std::atomic<bool> store_full{false};         // whether hits were lost because the store was too small
};

// Runs the exact test on the overlapping leaf pairs of a candidate. Adds one hit per touching link pair, with the
// lowest touching leaf pair, to worker.hits (key order) or worker.words (spatial order). With Report::kInContact only
// marks both instances as in contact if any leaf pair touches. May reorder `pairs`.
void report_candidate(const FrameContext& frame, const Candidate& candidate, Span<LeafPair> pairs, Worker& worker,
                      HitSink& sink);

// Begins a step whose tasks append their hits in turn. Each takes the lowest number that no other has taken
// (HitSink::next), so all lower ones are running or done, and it may wait for them.
inline void begin_turns(HitSink& sink) { sink.next = sink.turn = 0; }

// Waits for the turn of the worker's task, appends its hits to the caller's buffer, and passes the turn to the next
// task.
void finish_task(Worker& worker, HitSink& sink);

// Ends the search for hits: sets FrameJob::hit_count and hits_needed, and sorts the hits if they are not sorted yet. If
// the caller's buffer was too small, hit_count is 0.
void finish_hits(HitSink& sink);

}  // namespace cab
