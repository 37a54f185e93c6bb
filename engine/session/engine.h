// The engine: its articulations and batches, its workers, and the memory that the workers share.
#pragma once

#include "engine/broad_phase/crowd.h"
#include "engine/exact/fcl.h"
#include "engine/hits/hit_store.h"
#include "engine/session/worker_pool.h"
#include "engine/step/frame_context.h"
#include "layout/articulation.h"
#include "layout/convex_shapes.h"
#include "layout/link_bounds.h"

#include <cab/cab.h>

#include <atomic>
#include <memory>
#include <mutex>
#include <vector>

namespace cab {

// An articulation of the engine and all that is derived from it.
struct StoredArticulation {
  explicit StoredArticulation(const Allocator& allocator) : arena(allocator) {}

  // Whether the slot holds an articulation.
  bool in_use() const { return articulation.link_count != 0; }

  std::uint32_t serial = 0;  // of the id
  Arena arena;               // owns the memory of `articulation`, `link_bounds` and `convex_shapes`
  Articulation articulation;
  LinkBounds link_bounds;
  ConvexShapes convex_shapes;
  std::unique_ptr<FclShapes, FclShapesDelete> fcl_shapes;
};

// What sizes the memory that workers have and share: the worst-case counts over all batches of an engine.
struct MemoryNeeds {
  std::size_t nodes = 0;        // of one tile of all sequences, or of one tile of the largest character
  std::size_t round_nodes = 0;  // of one tile of all sequences, if leaves of one are balls and capsules
  std::size_t joints = 0;       // of the articulation with most links
  std::size_t skin = 0;         // most skin_tiles of an articulation
  std::size_t skin_rows = 0;    // likewise
  std::size_t skin_leaves = 0;  // most leaves of an articulation with a skin
  std::size_t surface_bones = 0, surface_blocks = 0, surface_patches = 0;  // SurfaceLeaves::most_bones and so on
  std::size_t closed_leaves = 0, surface_parts = 0;                        // of the SurfaceParts of an articulation
  std::size_t sequence_links = 0;                                          // of the sequence with most links
  std::size_t depth = 0;                // levels of the two deepest hierarchies together
  std::size_t leaf_pairs = 0;           // most leaf pairs of a candidate
  std::size_t character_instances = 0;  // over all batches of characters
  std::size_t character_nodes = 0;      // of the largest character
  std::size_t leaf_tiles = 0;           // of sixteen leaves, over all instances of characters
  std::size_t leaf_bounds_floats = 0;   // of an instance of the character with most leaves
  std::size_t character_tiles = 0;      // over all batches of characters
  std::size_t batch_slots = 0;          // in use or not
  std::size_t crowd_words = 0;          // LeafWords of all characters that a crowd takes
  std::size_t hits = 0;                 // of a frame, that are reserved
  std::size_t queries = 0;              // of one chunk of run_queries
  bool several_leaves = false;          // whether a link of a character has several leaves
  bool large = false;                   // whether a character is_large
};

// What the engine knows of the last frame, so that characters can rest in the next one (engine/session/rest.h).
struct RestState {
  std::uint64_t epoch = 1;          // grows whenever all instances count as moved
  bool known = false;               // whether the settings below are those of the last frame
  std::uint64_t failed_before = 0;  // Engine::frames_failed before the last frame was let in
  Policies policies;
  float margin = 0, min_depth = 0;
  bool containment = true;
  Report report = Report::kHits;
  Span<std::uint64_t> rule_bits;  // as Engine::rule_bits
};

// Room for a frame that begin_frame has begun (engine/frame/frame.cpp).
struct FrameInProgress;
struct FrameInProgressDelete {
  void operator()(FrameInProgress* frame) const;
};
using FrameInProgressPtr = std::unique_ptr<FrameInProgress, FrameInProgressDelete>;
FrameInProgressPtr make_frame_in_progress(std::uint32_t workers);

// The memory of run_queries, and what an engine remembers of the past (engine/queries).
struct QueryMemory;
struct QueryMemoryDelete {
  void operator()(QueryMemory* memory) const;
};
using QueryMemoryPtr = std::unique_ptr<QueryMemory, QueryMemoryDelete>;
// Makes memory for chunks of MemoryNeeds::queries queries. Throws std::bad_alloc.
QueryMemoryPtr make_query_memory(const MemoryNeeds& needs, std::size_t workers, const Allocator& allocator);

// The indexes that calls of run_queries share.
struct QueryIndexes;
struct QueryIndexesDelete {
  void operator()(QueryIndexes* indexes) const;
};
using QueryIndexesPtr = std::unique_ptr<QueryIndexes, QueryIndexesDelete>;
QueryIndexesPtr make_query_indexes();  // without any
// Makes room for another index: there must be one per reader. Throws std::bad_alloc.
void add_query_index(QueryIndexes& indexes, const MemoryNeeds& needs, const Allocator& allocator);

struct StoredHistory;
struct StoredHistoryDelete {
  void operator()(StoredHistory* history) const;
};
using StoredHistoryPtr = std::unique_ptr<StoredHistory, StoredHistoryDelete>;

struct HistoryMemory;
struct HistoryMemoryDelete {
  void operator()(HistoryMemory* memory) const;
};
using HistoryMemoryPtr = std::unique_ptr<HistoryMemory, HistoryMemoryDelete>;

// The same memory as `like` for one worker, with room for `histories` of them. Throws std::bad_alloc.
HistoryMemoryPtr make_history_memory(const HistoryMemory& like, std::size_t histories, const Allocator& allocator);

// How many bytes they take.
std::size_t query_bytes(const Engine& engine);
std::size_t history_bytes(const Engine& engine);

// What a read works with. Several reads may run beside each other, each with a reader of its own.
struct Reader {
  bool in_use = false;
  WorkerPool* pool = nullptr;  // that of the engine for the first reader, else own_pool
  WorkerPool own_pool;         // one worker, which has what reads need
  std::vector<std::unique_ptr<StoredBatch>>
      batches;             // by slot - 1: copies of those that the call binds, without arenas
  QueryMemoryPtr queries;  // null until reserve asks for it
  HistoryMemoryPtr past;   // null until there is a history
};

// Which calls hold an engine.
struct Holders {
  std::mutex mutex;          // held while a call begins or ends
  bool is_changing = false;  // a call that changes the engine: it is the only one
  std::uint32_t reading = 0;
};

// The state behind the public API (cab/cab.h).
struct Engine {
  Allocator allocator;
  Profiler profiler;                                               // without functions if there is none
  const kernel::KernelTable* kernels = nullptr;                    // of the instruction set that the engine runs
  std::vector<std::unique_ptr<StoredArticulation>> articulations;  // by slot - 1
  std::vector<std::unique_ptr<StoredBatch>> batches;               // by slot - 1
  WorkerPool pool;
  PairedBatches paired;
  Crowd crowd;
  HitStore hit_store;
  Span<std::uint64_t> rule_bits;  // the rules of the current job (engine/session/validate.cpp)
  RestState rest;
  std::atomic<std::uint64_t> frames_failed{0};  // how many answered anything but kOk
  std::uint64_t bounds_of_frame = 1;            // number of the last frame, or of what has changed bounds since
  std::vector<StoredHistoryPtr> histories;      // by slot - 1
  QueryIndexesPtr query_indexes;                // null until reserve asks for memory for queries
  MemoryNeeds sized;                            // what the memory suffices for
  std::unique_ptr<Arena>
      shared_arena;  // owns the rows of the crowd, bits of pairs and rules, the words of the hit store
  std::vector<std::unique_ptr<Reader>> readers;  // at least one, and one for each read that ran beside others
  std::mutex adding_reader;                      // held by a read that makes a reader for itself
  std::mutex bounds_mutex;  // held by a read that stores the last frame's bounds (store_crowd_bounds)
  mutable Holders holders;
  FrameInProgressPtr frame;  // holds a Call itself, so it is destroyed first

  StoredBatches stored_batches() const { return batches; }
  InstanceBatch& batch(BatchId id) { return batches[slot_of(id).value - 1]->batch; }
  const InstanceBatch& batch(BatchId id) const { return batches[slot_of(id).value - 1]->batch; }
};

// The id of what is in a slot.
template <class Slots>
std::uint64_t id_of(std::size_t index, const Slots& slots) {
  return (index + 1) | std::uint64_t{slots[index]->serial} << 32;
}

// The index of the slot that an id names, or the number of slots if it names none that is in use. slots: batches or
// articulations of the engine. An id that is more than a slot must be the one that was given out last.
template <class Slots>
std::size_t index_of(std::uint64_t id, const Slots& slots) {
  const auto index = static_cast<std::size_t>(static_cast<std::uint32_t>(id)) - 1;
  if (index >= slots.size() || !slots[index]->in_use()) return slots.size();
  return id >> 32 == 0 || id == id_of(index, slots) ? index : slots.size();
}

// Whether an id names a batch of the engine.
inline bool has_batch(const Engine& engine, BatchId id) {
  return index_of(id.value, engine.batches) < engine.batches.size();
}

// Returns what the steps of a frame read. run_frame passes resolved policies.
inline FrameContext context_of(const Engine& engine, const Policies& policies, const FrameJob& job) {
  return {*engine.kernels, engine.stored_batches(), engine.paired, policies, job.margin, job.report, job.containment};
}

}  // namespace cab
