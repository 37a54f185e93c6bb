// Steps 5 and 6 of a frame: overlapping leaf pairs -> exact tests -> hits.
#pragma once

#include "engine/frame_context.h"
#include "engine/hit_store.h"
#include "layout/pair_list.h"

#include <atomic>

namespace cab {

struct Candidate;
struct Worker;
struct WorkerPool;

// Where hits go: the caller's buffer, and how many were found so far (which may be more than it holds). Tasks that run in
// key order append to the caller's buffer in the order of tasks, whichever thread ran them. Tasks that run in spatial
// order put their hits into the store, from which they are written in key order at the end.
struct HitSink {
  FrameJob* job;
  HitStore* store;
  std::atomic<std::size_t> found{0};
  std::atomic<std::uint32_t> turn{0};  // the task whose hits come next
  bool sorted = true;                  // hits stand in the order that the caller was promised
  bool in_spatial_order = false;
  std::atomic<std::uint64_t> stored_words{0};
  std::atomic<bool> store_full{false};
};

// Confirms leaf pairs of one candidate by the exact policy and adds one hit per touching link pair, with its lowest touching
// leaf pair, to the task's hits or groups; with Report::kInContact only notes whether there is one. Reorders the pairs.
void report_candidate(const FrameContext& frame, const Candidate& candidate, Span<LeafPair> pairs, Worker& worker,
                      HitSink& sink);

// Appends the hits of the worker's task to the caller's buffer when its turn has come, and passes the turn on.
void finish_task(Worker& worker, HitSink& sink);

// Sorts the hits that were found, if they do not stand sorted, and, where the caller wants contacts, asks for them.
// kHitsOverflow when the buffer was too small.
Status finish_hits(const FrameContext& frame, WorkerPool& pool, HitSink& sink);

}  // namespace cab
