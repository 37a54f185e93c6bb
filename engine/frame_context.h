// What the steps of a frame read.
#pragma once

#include "engine/broad_phase/grid.h"
#include "engine/exact.h"
#include "kernels/kernel_table.h"
#include "layout/arena.h"
#include "layout/instance_batch.h"

#include <memory>

namespace cab {

// A batch in the engine, with the exact shapes of its articulation.
struct BatchSlot {
  explicit BatchSlot(const Allocator& allocator) : arena(allocator) {}

  Arena arena;
  InstanceBatch batch;
  const FclShapes* fcl_shapes = nullptr;
};

// What every step of a frame may read. Steps write to a worker's memory, to the grid or to the caller's spans, which they
// are given apart.
struct FrameContext {
  const kernel::KernelTable& kernels;
  Span<const std::unique_ptr<BatchSlot>> slots;  // by the index of a batch
  const BroadPhase& broad_phase;
  Policies policies;  // `auto` is resolved: those of characters and of sequences may differ
  float margin = 0;
  Report report = Report::kHits;

  const InstanceBatch& batch(std::uint32_t index) const { return slots[index]->batch; }

  // Whether one touching pair says all that is asked about a candidate.
  bool first_only() const { return report == Report::kInContact && policies.exact == Exact::kNone; }

  // One leaf of one instance for an exact test.
  ExactLeaf exact_leaf(std::uint32_t batch_index, std::uint32_t instance, std::uint32_t leaf) const {
    return {slots[batch_index]->fcl_shapes, &batch(batch_index), instance, leaf};
  }
};

}  // namespace cab
