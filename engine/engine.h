// The engine: its articulations and batches, its workers, and the memory that the workers share.
#pragma once

#include "engine/exact_fcl.h"
#include "engine/hit_store.h"
#include "engine/worker.h"
#include "layout/articulation.h"

#include <cab/cab.h>

#include <atomic>
#include <memory>
#include <vector>

namespace cab {

// An articulation of the engine and all that is derived from it.
struct StoredArticulation {
  explicit StoredArticulation(const Allocator& allocator) : arena(allocator) {}

  Arena arena;  // owns the memory of `articulation`, `link_bounds` and `convex_shapes`
  Articulation articulation;
  LinkBounds link_bounds;
  ConvexShapes convex_shapes;
  std::unique_ptr<FclShapes, FclShapesDelete> fcl_shapes;
};

// The state behind the public API (cab/cab.h).
struct Engine {
  Allocator allocator;
  const kernel::KernelTable* kernels = nullptr;                    // of the instruction set that the engine runs
  std::vector<std::unique_ptr<StoredArticulation>> articulations;  // by ArticulationId::value - 1
  std::vector<std::unique_ptr<StoredBatch>> batches;               // by BatchId::value - 1
  WorkerPool pool;
  BroadPhase broad_phase;
  HitStore hit_store;
  Span<std::uint64_t> rule_bits;             // scratch of validate_job: one bit per possible rule
  std::unique_ptr<Arena> shared_arena;       // owns the grid, paired_bits, the words of the hit store and rule_bits
  std::atomic_flag busy = ATOMIC_FLAG_INIT;  // set while a Call holds the engine

  Span<const std::unique_ptr<StoredBatch>> stored_batches() const { return {batches.data(), batches.size()}; }
  InstanceBatch& batch(BatchId id) { return batches[id.value - 1]->batch; }
  const InstanceBatch& batch(BatchId id) const { return batches[id.value - 1]->batch; }
};

// Returns what the steps of a frame read. run_frame passes resolved policies. compute_boxes passes those of the caller,
// since its steps do not read the strategy.
inline FrameContext context_of(const Engine& engine, const Policies& policies, float margin, Report report) {
  return {*engine.kernels, engine.stored_batches(), engine.broad_phase, policies, margin, report};
}

}  // namespace cab
