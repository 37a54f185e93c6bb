// Step 6 of a frame for characters in spatial order: stores hits as tasks find them, and writes them in key order at
// the end.
#pragma once

#include "engine/frame_context.h"
#include "layout/pair_list.h"

#include <algorithm>

namespace cab {

struct Candidate;
struct FrameRun;
struct HitSink;
struct Worker;

// The hits of a frame in groups, one group per candidate. Groups with the same first instance form a chain, which
// starts in the HitChain of that instance. Between frames the words stay: hits of two that rest need not be found
// again.
struct HitStore {
  Span<std::uint32_t> words;              // the groups one after the other (engine/hit_store.cpp)
  std::uint32_t used = 0;                 // how many words hold the groups of the last frame
  bool holds_last = false;                // whether they are all of its hits, and it answered kOk
  std::uint32_t frames_in_key_order = 0;  // how many of the next frames are paired in key order
};

// Size of the store in words, for the number of instances of all character batches. A group takes six words, and one
// word per hit. A frame whose hits do not fit is paired in key order. Few instances may each meet all others: up to a
// size of 1 MiB, every two may have two hits.
inline std::size_t store_words(std::size_t instances) {
  constexpr std::size_t kPerInstance = 32, kOfFew = 1u << 18, kMost = 0xffffffff;
  const std::size_t pairs = instances < kOfFew ? instances * instances / 2 : kOfFew;
  return std::min(std::max(kPerInstance * instances, std::min(8 * pairs, kOfFew)), kMost);
}

// How many instances' chains one task writes to the caller's buffer.
inline constexpr std::uint32_t kWrittenPerTask = 1024;

// Starts the store of a frame in spatial order with those groups of the last frame whose instances both rest, unless
// their rule skips them, and marks these instances as in contact. The store must hold the last frame. Gaps close, so
// there is room for the hits of any frame that fits without them.
void keep_hits(FrameRun& run);

// Ends a frame that answered kOk: says whether the store holds its hits.
void hold_hits(FrameRun& run);

// Finds the touching link pairs of a candidate (for_each_touching) and appends its hits to worker.words as one group.
// Stores the earlier groups first if there is no room. Sets HitSink::store_full if the group can be larger than
// worker.words.
void add_group(const FrameContext& frame, const Candidate& candidate, Span<LeafPair> pairs, Worker& worker,
               HitSink& sink);

// The same for several candidates, where every overlapping leaf pair touches and is a link pair of its own. pairs: as
// kernel::RigidPairs has them, in the order of candidates and of links. candidate_of: the number of each slot's
// candidate.
void add_groups_of_leaves(const FrameContext& frame, const Candidate* candidates, const std::uint32_t* candidate_of,
                          Span<const std::uint32_t> pairs, Worker& worker, HitSink& sink);

// Moves the groups in worker.words into the store and its chains. If they do not fit, drops them and sets
// HitSink::store_full.
void store_groups(const FrameContext& frame, Worker& worker, HitSink& sink);

// Counts the stored hits. Without tasks in a frame in key order.
std::uint32_t begin_counting_hits(FrameRun& run);
void count_hits(FrameRun& run, std::uint32_t task, std::uint32_t worker);

// Adds their number to HitSink::found, and writes to the caller's buffer, in key order, those for which it has room.
std::uint32_t begin_writing_hits(FrameRun& run);
void write_hits(FrameRun& run, std::uint32_t task, std::uint32_t worker);

}  // namespace cab
