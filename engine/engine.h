// The engine's own state: what create and add make, and what calls share.
#pragma once

#include "engine/exact_fcl.h"
#include "engine/hit_store.h"
#include "engine/worker.h"
#include "kernels/find_kernels.h"
#include "layout/articulation.h"

#include <cab/cab.h>

#include <atomic>
#include <memory>
#include <vector>

namespace cab {

struct ArticulationSlot {
  explicit ArticulationSlot(const Allocator& allocator) : arena(allocator) {}

  Arena arena;
  Articulation articulation;
  LinkBounds link_bounds;
  std::unique_ptr<FclShapes, FclShapesDelete> fcl_shapes;
};

struct Engine {
  Allocator allocator;
  const kernel::KernelTable* kernels = nullptr;
  std::vector<std::unique_ptr<ArticulationSlot>> articulations;
  std::vector<std::unique_ptr<BatchSlot>> batches;
  WorkerPool pool;
  BroadPhase broad_phase;
  HitStore hit_store;
  Span<std::uint64_t> rule_bits;        // scratch of validate_job: rules seen so far
  std::unique_ptr<Arena> shared_arena;  // of what all workers share: grid, store and bits
  std::atomic_flag busy = ATOMIC_FLAG_INIT;

  Span<const std::unique_ptr<BatchSlot>> slots() const { return {batches.data(), batches.size()}; }
  InstanceBatch& batch(BatchId id) { return batches[id.value - 1]->batch; }
  const InstanceBatch& batch(BatchId id) const { return batches[id.value - 1]->batch; }
};

// What the steps of a frame read, by policies without `auto`.
inline FrameContext context_of(const Engine& engine, const Policies& policies, float margin, Report report) {
  return {*engine.kernels, engine.slots(), engine.broad_phase, policies, margin, report};
}

}  // namespace cab
