// The memory of one worker, reused in every frame, and the pool of all workers.
#pragma once

#include "engine/broad_phase/partner.h"
#include "engine/candidate.h"
#include "engine/link_pairs.h"
#include "engine/posed_set.h"
#include "engine/task_runner.h"
#include "layout/arena.h"
#include "layout/pair_list.h"

#include <memory>
#include <vector>

namespace cab {

// Candidates that a worker gathers at a time, and the leaf pairs of those that it tests at a time (one candidate may have
// more).
inline constexpr std::uint32_t kChunkCandidates = 256;
inline constexpr std::uint32_t kChunkLeafPairs = 1u << 16;

// Hits of one task, and words of one task's groups of hits, that a worker keeps at a time. Neither limits what a frame can
// hold.
inline constexpr std::uint32_t kTaskHits = 4096;
inline constexpr std::uint32_t kTaskWords = 1u << 14;

// Memory of one worker. Sized when a batch is added, for the worst that any rule can ask.
struct alignas(64) Worker {
  explicit Worker(const Allocator& allocator) : arena(allocator) {}

  Arena arena;
  Span<BoxTile> boxes;    // the hierarchy of one tile of every sequence, or of one tile of characters
  Span<AabbTile> bounds;  // the same, axis-aligned
  Span<PointTile> joints;
  Span<MotionTile> motions;  // of one tile's links, for refits that need them
  Span<MomentTile> moments;  // of one tile's nodes, likewise
  Span<std::uint32_t> live;  // by sequence: lanes of the tile at hand that take part
  FixedList<NodePair> stack;
  FixedList<TilePair> tile_stack;
  FixedList<TilePair> tile_found;
  FixedList<LeafPair> found;
  FixedList<Candidate> candidates;
  PosedSet posed;
  PosedLinkSet posed_links;
  FixedList<LeafPair> link_pairs;  // strategy links: links of candidates whose boxes overlap
  FixedList<Partner> partners;
  std::uint32_t task = 0;          // the task at hand
  FixedList<Hit> hits;             // of the task at hand, until its turn comes
  FixedList<std::uint32_t> words;  // groups of hits, until they are stored (engine/hit_store.cpp)
  ExtentHistogram histogram;
  FrameStats stats;
  FrameStats stats_before;  // before characters were paired in spatial order, should they be paired again
};

// The engine's workers and what runs tasks on them.
struct WorkerPool {
  std::unique_ptr<TaskRunner> tasks;
  std::vector<std::unique_ptr<Worker>> workers;

  Worker& operator[](std::uint32_t worker) const { return *workers[worker]; }

  // Workers that this frame runs on.
  std::size_t working_count() const { return tasks->alone ? 1 : workers.size(); }
};

}  // namespace cab
