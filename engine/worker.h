// Workers: the memory of each thread that runs tasks, reused in every frame, and the pool of all workers.
#pragma once

#include "engine/broad_phase/partner.h"
#include "engine/candidate.h"
#include "engine/exact_convex.h"
#include "engine/link_pairs.h"
#include "engine/posed_set.h"
#include "engine/task_runner.h"
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

// Capacity of Worker::hits and Worker::words. A worker empties them when they are full, so a task may find more hits.
inline constexpr std::uint32_t kTaskHits = 4096;
inline constexpr std::uint32_t kTaskWords = 1u << 14;

// Capacity of Worker::waiting, where an articulation is large.
inline constexpr std::uint32_t kWaitingCandidates = 8192;

// The memory of one worker. Whenever a batch is added, it is sized for the worst case of every rule
// (engine/memory.cpp).
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
  FixedList<EntryPair> waiting;     // spatial order: candidates of large articulations that are not collected yet
  PosedSet posed;                   // the instances of `candidates`
  PosedLinkSet posed_links;         // strategy `links`: posed leaves of links whose boxes overlap
  FixedList<LeafPair> link_pairs;   // strategy `links`: pairs of links whose boxes overlap
  Span<CrowdScratch> crowd;         // one, if there are crowds (engine/frame/crowd.h)
  Span<std::uint32_t> crowd_pairs;  // leaf pairs to test, and in the second half those that overlap
  FixedList<Partner> partners;      // key order: partners of one instance
  std::uint32_t task = 0;           // index of the task that runs
  FixedList<Hit> hits;              // key order and sequences: hits of that task, until its turn comes
  FixedList<std::uint32_t> words;   // spatial order: groups of hits, until they are stored (engine/hit_store.cpp)
  ExtentHistogram histogram;        // of the instances that this worker bounded
  ExtentHistogram resting;          // of those that rest, and are not in the kept grid
  std::uint32_t kept = 0;           // how many instances rest and are in the kept grid
  FrameStats stats;                 // of this frame
  FrameStats stats_before;          // before pairing in spatial order, in case its hits do not fit into the store
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
