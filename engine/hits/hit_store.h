// The hits of characters: stored as tasks find them, and written in key order at the end of the frame.
#pragma once

#include "engine/step/frame_context.h"
#include "layout/pair_list.h"

#include <algorithm>
#include <atomic>
#include <memory>
#include <mutex>

namespace cab {

struct Candidate;
struct HitSink;

// The store consists of blocks of words. Only one worker at a time writes into a block. Its first word is how many of
// its words are in use, that one included.
inline constexpr std::uint32_t kBlockBits = 13;
inline constexpr std::uint32_t kBlockWords = 1u << kBlockBits;

// Blocks that follow each other in memory.
struct HitSegment {
  std::uint32_t first, count;  // numbers of blocks
  std::uint32_t* words;
};

// The hits of a frame in groups, one group per candidate, or several if there are many (engine/hits/hit_store.cpp).
// Groups with the same first instance form a chain, which starts in the HitChain of that instance. Between frames the
// words stay: hits of two that rest need not be found again.
struct HitStore {
  static constexpr std::uint32_t kMostSegments = 32, kMostBlocks = 1u << (32 - kBlockBits);

  HitSegment segments[kMostSegments];  // the first is part of the engine's memory, the others are of frames with
  std::uint32_t segment_count = 0;     // more hits than had fitted before
  std::unique_ptr<Arena> grown;        // owns the others
  std::mutex growing;
  std::atomic<std::uint32_t> blocks{0};   // of all segments
  std::atomic<std::uint32_t> claimed{0};  // of the current or the last frame
  bool holds_last = false;                // whether they hold all hits of the last frame, and it answered kOk

  // Replaces all memory by the blocks of `words`. for_more: an empty arena, for what they cannot hold.
  void reset(Span<std::uint32_t> words, std::unique_ptr<Arena> for_more) noexcept;

  // The word with a number: that of its block, and its place in the block.
  std::uint32_t* word(std::uint32_t at) const {
    const HitSegment* of = segments;
    while ((at >> kBlockBits) - of->first >= of->count) ++of;
    return of->words + (at - (of->first << kBlockBits));
  }
  std::uint32_t* block(std::uint32_t number) const { return word(number << kBlockBits); }
};

// How many blocks a store begins with, for the number of instances of all character batches and the hits that the
// caller reserves. A group takes six words, and one word per hit. Few instances may each meet all others: up to a size
// of 1 MiB, each pair may have two hits. Groups of different sizes leave gaps at the ends of blocks.
inline std::size_t store_blocks(std::size_t instances, std::size_t reserved, std::size_t workers) {
  constexpr std::size_t kPerInstance = 16, kOfFew = 1u << 18, kMostPerHit = 8;
  if (instances == 0) return 0;
  const std::size_t pairs = instances < kOfFew ? instances * instances / 2 : kOfFew;
  const std::size_t words = std::max({kPerInstance * instances, std::min(8 * pairs, kOfFew), kMostPerHit * reserved});
  return std::min<std::size_t>(words / kBlockWords + workers, HitStore::kMostBlocks);
}

// Where a worker puts its groups: a block that it has claimed.
struct HitBlock {
  std::uint32_t* words = nullptr;  // null until the worker has a hit
  std::uint32_t number = 0;
  std::uint32_t used = 0;  // as the first word says
  std::uint32_t hits = 0;
};

// How many instances' chains one task writes to the caller's buffer.
inline constexpr std::uint32_t kWrittenPerTask = 1024;

// Empties the store. The words of the last frame stay until they are written over. Returns in how many blocks they are.
std::uint32_t begin_storing(HitSink& sink);

// Starts the store of a frame with those groups of the last frame whose instances both rest, unless their rule skips
// them, and marks these instances as in contact. The store must hold the last frame, in so many blocks. Gaps close, so
// the groups need no more blocks than in the last frame.
void keep_hits(const FrameContext& frame, std::uint32_t last_blocks, HitBlock& block, FrameStats& stats, HitSink& sink);

// Finds the touching link pairs of a candidate (for_each_touching) and stores its hits.
void add_group(const FrameContext& frame, const Candidate& candidate, Span<LeafPair> pairs, HitBlock& block,
               FrameStats& stats, HitSink& sink);

// The same for several candidates, where every overlapping leaf pair touches and is a link pair of its own. pairs: as
// kernel::RigidPairs has them, in the order of candidates and of links. candidate_of: the number of each slot's
// candidate.
void add_groups_of_leaves(const FrameContext& frame, const Candidate* candidates, const std::uint32_t* candidate_of,
                          Span<const std::uint32_t> pairs, HitBlock& block, FrameStats& stats, HitSink& sink);

// Lays out the tasks that count the stored hits, and counts those of one.
std::uint32_t begin_counting_hits(StoredBatches batches);
void count_hits(StoredBatches batches, std::uint32_t task);

// Adds their number to HitSink::found, and lays out the tasks that write them to the caller's buffer in key order if it
// has room for them. in_open_blocks: how many hits are in the workers' own blocks.
std::uint32_t begin_writing_hits(StoredBatches batches, std::uint64_t in_open_blocks, HitSink& sink);
void write_hits(const FrameContext& frame, std::uint32_t task, FrameStats& stats, const HitSink& sink);

}  // namespace cab
