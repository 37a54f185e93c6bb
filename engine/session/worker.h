// Workers: the memory of each thread that runs tasks, reused in every frame, and the pool of all workers.
#pragma once

#include "engine/exact/convex.h"
#include "engine/hits/hit_store.h"
#include "engine/pairs/link_pairs.h"
#include "engine/pairs/posed_set.h"
#include "engine/step/candidate.h"
#include "engine/step/task_runner.h"
#include "layout/arena.h"
#include "layout/pair_list.h"

#include <memory>
#include <vector>

namespace cab {

struct CrowdScratch;

// Most candidates that a worker collects before it tests them, and most leaf pairs of the candidates that it tests
// together. A single candidate may have more leaf pairs.
inline constexpr std::uint32_t kChunkCandidates = 256;
inline constexpr std::uint32_t kChunkLeafPairs = 1u << 16;

// Capacity of Worker::hits. A worker empties it when it is full, so a task may find more hits.
inline constexpr std::uint32_t kTaskHits = 4096;

// Capacity of Worker::waiting, where an articulation is large.
inline constexpr std::uint32_t kWaitingCandidates = 8192;

// The memory of one worker. Whenever a batch is added, it is sized for the worst case of every rule
// (engine/session/memory.cpp).
struct alignas(64) Worker {
  explicit Worker(const Allocator& allocator) : arena(allocator) {}

  Arena arena;                      // owns the arrays and lists below
  Span<BoxTile> boxes;              // by node: one tile of every sequence, or one tile of characters
  Span<AabbTile> bounds;            // the same, axis-aligned
  Span<PointTile> joints;           // by link: the joints of the tile that is updated
  Span<MotionTile> motions;         // by link: the poses of that tile, for Refit::kAabbVertices and sweep_margins
  Span<MotionTile> last_motions;    // by link: the poses of a tile in the frame before, for sweep_margins
  Span<MomentTile> moments;         // by node: scratch of Refit::kCovarianceLeaves
  Span<std::uint32_t> live;         // by batch index: bits of the live lanes in the current tile of a sequence
  FixedList<NodePair> stack;        // characters: node pairs that a traversal has yet to test
  FixedList<TilePair> tile_stack;   // sequences: the same
  FixedList<TilePair> tile_found;   // sequences: overlapping leaf pairs of two tiles
  FixedList<LeafPair> found;        // overlapping leaf pairs, before the exact test
  Span<ConvexQueue> convex_queues;  // Exact::kConvex: by the kinds of a and b
  FixedList<Candidate> candidates;  // collected, and not tested yet
  FixedList<RowPair> waiting;       // candidates of large articulations that are not collected yet
  PosedSet posed;                   // the instances of `candidates`
  PosedLinkSet posed_links;         // strategy `links`: posed leaves of links whose boxes overlap
  FixedList<LeafPair> link_pairs;   // strategy `links`: pairs of links whose boxes overlap
  Span<CrowdScratch> crowd;         // one, if there are crowds (engine/broad_phase/crowd_scratch.h)
  Span<std::uint32_t> crowd_pairs;  // leaf pairs to test, and in the second half those that overlap
  FixedList<Hit> hits;              // sequences: hits that are not in the caller's buffer yet
  HitBlock hit_block;               // characters: where their hits go
  std::uint32_t kept = 0;           // how many instances rest and are in the kept strips
  std::uint32_t resting = 0;        // how many rest and are not
  FrameStats stats;                 // of this frame
};

// The workers of an engine, and the runner of their tasks.
struct WorkerPool {
  std::unique_ptr<TaskRunner> tasks;
  std::vector<std::unique_ptr<Worker>> workers;

  Worker& operator[](std::uint32_t worker) const { return *workers[worker]; }

  // Number of workers that run tasks in this frame.
  std::size_t working_count() const { return tasks->alone ? 1 : workers.size(); }
};

}  // namespace cab
