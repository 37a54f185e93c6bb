// The engine's own state: what create and add make, and the memory that workers reuse in every frame.
#pragma once

#include "engine/exact.h"
#include "engine/grid.h"
#include "engine/task_runner.h"
#include "kernels/find_kernels.h"
#include "layout/arena.h"
#include "layout/articulation.h"
#include "layout/box_aos.h"
#include "layout/instance_batch.h"
#include "layout/pair_list.h"
#include "layout/tile.h"

#include <cab/cab.h>

#include <atomic>
#include <memory>
#include <vector>

namespace cab {

// Two instances to be tested: (batch, instance) of a is lower than that of b, or the same within one instance.
struct Candidate {
  std::uint32_t batch_a, instance_a;
  std::uint32_t batch_b, instance_b;
  std::uint32_t slot_a = 0, slot_b = 0;  // of their boxes in the worker's set (engine/posed_set.h)
};

inline bool is_within(const Candidate& candidate) {
  return candidate.batch_a == candidate.batch_b && candidate.instance_a == candidate.instance_b;
}

// The grid entry of an instance that was not looked up in the grid.
inline constexpr std::uint32_t kNoEntry = 0xffffffff;

// What the broad phase finds for an instance: another, and where it stands in the grid.
struct Partner {
  std::uint64_t key;  // instance_key
  std::uint32_t entry;
};

// Instances of one batch that are posed together.
struct TileInstances {
  std::uint32_t instance[kLanes];
  std::uint32_t count;
};

// A tile of a worker's set: the boxes of instance `lane` stand at boxes + lane * nodes.
struct PosedTile {
  TileInstances instances;
  Placement placement[kLanes];
  std::uint32_t batch;
  std::uint32_t nodes;
  BoxAos* boxes;
  float* leaf_bounds;
};

// Where an instance stands in a worker's set: an entry of its hash table, empty unless `generation` is the set's.
struct PosedEntry {
  std::uint64_t key;
  std::uint32_t generation;
  std::uint32_t slot;
};

// Drops all entries of a table at once, by the next generation; once in 2^32 they are emptied.
template <class Entry>
void begin_generation(std::uint32_t& generation, Span<Entry> entries) {
  if (++generation != 0) return;
  for (Entry& entry : entries) entry = {};
  generation = 1;
}

// The instances whose boxes the candidates at hand need, each once, posed where they are tested.
struct PosedSet {
  FixedList<PosedTile> tiles;
  Span<std::uint32_t> open;      // by batch: one more than the index of its tile that takes instances, or 0
  Span<PosedEntry> entries;      // a power of two
  FixedList<BoxAos> boxes;       // an axis-aligned refit keeps AabbAos in the same memory
  FixedList<float> leaf_bounds;  // layout/leaf_bounds_soa.h
  std::uint32_t generation = 1;
};

// Where the leaves of one link of one instance stand, valid while `generation` is the set's.
struct PosedLinkEntry {
  std::uint32_t generation;
  std::uint32_t first;  // padded to whole tiles
};

// Strategy links: leaves of the links whose boxes overlap those of another, posed when they are first asked for.
struct PosedLinkSet {
  FixedList<BoxAos> boxes;
  FixedList<float> leaf_bounds;  // layout/leaf_bounds_soa.h, six floats per box
  Span<PosedLinkEntry> entries;  // by the index of the link's box in the PosedSet
  std::uint32_t generation = 1;
};

// Memory of one worker. Sized when a batch is added, for the worst that any rule can ask.
struct alignas(64) Worker {
  explicit Worker(const Allocator& allocator) : arena(allocator) {}

  Arena arena;
  Span<BoxTile> boxes;    // one tile's hierarchy of every sequence, or of one character batch
  Span<AabbTile> bounds;  // the same, axis-aligned
  Span<PointTile> joints;
  Span<MotionTile> motions;  // of one tile's links, for refits that need them
  Span<MomentTile> moments;  // of one tile's nodes, likewise
  Span<std::uint32_t> live;  // of every batch's tile at hand: lanes that take part
  FixedList<NodePair> stack;
  FixedList<TilePair> tile_stack;
  FixedList<TilePair> tile_found;
  FixedList<LeafPair> found;
  FixedList<Candidate> candidates;
  PosedSet posed;
  PosedLinkSet posed_links;
  FixedList<LeafPair> link_pairs;  // strategy links: links of candidates whose boxes overlap
  FixedList<Partner> partners;
  FixedList<Hit> hits;             // of the task at hand, until its turn comes
  FixedList<std::uint32_t> words;  // or groups of hits, until they are stored (engine/report.cpp)
  ExtentHistogram histogram;
  FrameStats stats;
  FrameStats stats_before;  // the pairing of characters, should it begin again
};

struct ArticulationSlot {
  explicit ArticulationSlot(const Allocator& allocator) : arena(allocator) {}

  Arena arena;
  Articulation articulation;
  LinkBounds link_bounds;
  std::unique_ptr<ExactShapes, ExactShapesDelete> shapes;
};

struct BatchSlot {
  explicit BatchSlot(const Allocator& allocator) : arena(allocator) {}

  Arena arena;
  InstanceBatch batch;
};

struct Engine {
  Allocator allocator;
  const kernel::KernelTable* kernels = nullptr;
  std::unique_ptr<TaskRunner> tasks;
  std::vector<std::unique_ptr<ArticulationSlot>> articulations;
  std::vector<std::unique_ptr<BatchSlot>> batches;
  std::vector<std::unique_ptr<Worker>> workers;
  std::unique_ptr<Arena> shared_arena;
  Grid grid;
  Span<std::uint32_t> store;  // hits of characters found in spatial order, until they are written in key order
  std::uint32_t frames_in_key_order = 0;  // frames to come that are paired in key order
  Span<std::uint64_t> rule_bits;          // scratch of validate_job: rules seen so far
  Span<std::uint64_t> paired_bits;        // bit a * batch_count + b: some rule tests batch a against b
  std::atomic_flag busy = ATOMIC_FLAG_INIT;

  InstanceBatch& batch(BatchId id) { return batches[id.value - 1]->batch; }
  const InstanceBatch& batch(BatchId id) const { return batches[id.value - 1]->batch; }
};

// Candidates that a worker gathers at a time, and the leaf pairs of those that it tests at a time (one candidate may have
// more).
inline constexpr std::uint32_t kChunkCandidates = 256;
inline constexpr std::uint32_t kChunkLeafPairs = 1u << 16;

// Tiles that a worker's set holds at most, and the boxes that it has room for at least: little enough to stay in
// the second level of cache, enough that few instances are posed more than once.
inline constexpr std::uint32_t kPosedTiles = 24;
inline constexpr std::size_t kPosedBoxes = kPosedTiles * kLanes * 31;
inline constexpr std::size_t kPosedLeafFloats = kPosedTiles * kLanes * 6 * kLanes;

// Leaves, padded to whole tiles, that a worker's posed links hold: two links of the most leaves at least.
inline constexpr std::uint32_t kPosedLinkLeaves = 4096;
static_assert(kPosedLinkLeaves >= 2 * kMaxLeaves);

// Words of the store for each instance: one a hit, and six for each two instances that touch. Frames with more hits are
// paired in their order.
inline constexpr std::size_t kStoreWords = 32;

// Instances whose stored hits one task writes.
inline constexpr std::uint32_t kStoredPerTask = 1024;

// Partners of one instance, and hits of one task, that a worker keeps at a time; neither limits what a frame can hold.
inline constexpr std::uint32_t kPartnerCapacity = 4096;
inline constexpr std::uint32_t kTaskHits = 4096;
inline constexpr std::uint32_t kTaskWords = 1u << 14;

}  // namespace cab
