// Step 6 of a frame, spatial order: hits of characters are stored as they are found, and written in key order at the end.
#pragma once

#include "engine/frame_context.h"
#include "layout/pair_list.h"

namespace cab {

struct Candidate;
struct HitSink;
struct Worker;
struct WorkerPool;

// Groups of hits, one per candidate. The groups of one instance are chained (StoredHits).
struct HitStore {
  Span<std::uint32_t> words;
  std::uint32_t frames_in_key_order = 0;  // frames to come that are not paired in spatial order
};

// Words of the store per instance: one per hit, and six per two instances that touch. Frames with more hits are paired in
// key order.
inline constexpr std::size_t kStoreWords = 32;

// Instances whose stored hits one task writes.
inline constexpr std::uint32_t kStoredPerTask = 1024;

// Adds the hits of one candidate to the worker's groups, and stores those first if there is no room.
void add_group(const FrameContext& frame, const Candidate& candidate, Span<LeafPair> pairs, Worker& worker,
               HitSink& sink);

// Puts a worker's groups into the store. Sets HitSink::store_full if there is no room.
void store_hits(const FrameContext& frame, Worker& worker, HitSink& sink);

// Writes all hits of the store to the caller's buffer, in key order.
void write_stored_hits(const FrameContext& frame, WorkerPool& pool, HitSink& sink);

}  // namespace cab
