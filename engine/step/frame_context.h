// The frame context: what all steps of a frame read.
#pragma once

#include "engine/broad_phase/crowd_memory.h"
#include "engine/exact/exact.h"
#include "engine/session/static_bodies.h"
#include "kernels/kernel_table.h"
#include "layout/arena.h"
#include "layout/instance_batch.h"

#include <memory>

namespace cab {

// A batch of the engine, with the exact shapes of its articulation or of its static bodies.
struct StoredBatch {
  explicit StoredBatch(const Allocator& allocator) : arena(allocator) {}

  // Whether the slot holds a batch. If not, it has no instances.
  bool in_use() const { return batch.articulation != nullptr; }

  std::uint16_t generation = 0;  // how many batches the slot held before
  Arena arena;                   // owns the arrays of `batch`
  InstanceBatch batch;
  CrowdBatch crowd;                             // its arrays are in `arena`
  std::unique_ptr<StaticBodies> statics;        // null unless the instances are static bodies
  const FclShapes* fcl_shapes = nullptr;        // owned by the articulation or by `statics`
  const ConvexShapes* convex_shapes = nullptr;  // likewise
};

// The batches of an engine, by slot - 1.
using StoredBatches = Span<const std::unique_ptr<StoredBatch>>;

// Which batches of characters are paired in a frame, by index.
struct PairedBatches {
  Span<std::uint64_t> bits;      // bit a * count + b: whether a rule pairs batches a and b
  Span<std::uint64_t> skipped;   // the same: whether not those instances of which both rest
  std::size_t count = 0;         // of batches
  bool reports_resting = false;  // whether a rule reports the hits of two instances that both may rest

  static bool has_bit(Span<std::uint64_t> of, std::size_t bit) { return of[bit >> 6] >> (bit & 63) & 1; }
  bool paired(std::uint32_t a, std::uint32_t b) const { return has_bit(bits, a * count + b); }
  bool skips_resting(std::uint32_t a, std::uint32_t b) const { return has_bit(skipped, a * count + b); }
};

// What every step of a frame reads. What a step writes is passed separately: a worker, the crowd, the hit sink. Arrays
// of a batch are the exception, such as the caller's flags and in_contact: steps write them through `batches`.
struct FrameContext {
  const kernel::KernelTable& kernels;
  StoredBatches batches;
  const PairedBatches& paired;
  // With resolved strategy; characters and sequences have a context each. kAuto: batches of characters have strategies
  // that differ.
  Policies policies;
  float margin = 0;  // FrameJob::margin
  Report report = Report::kHits;
  // Whether the store already has the hits of two that rest, and of one within itself (keep_hits): they are no
  // candidates.
  bool keeps_hits = false;

  const InstanceBatch& batch(std::uint32_t index) const { return batches[index]->batch; }

  // Whether one overlapping leaf pair is all that a candidate is tested for: the frame asks only which instances are in
  // contact, and no exact test follows.
  bool first_only() const { return report == Report::kInContact && policies.exact == Exact::kNone; }

  // The arguments of an exact test for one leaf of one instance.
  ExactLeaf exact_leaf(std::uint32_t batch_index, std::uint32_t instance, std::uint32_t leaf) const {
    const StoredBatch& stored = *batches[batch_index];
    return {stored.fcl_shapes, stored.convex_shapes, &stored.batch, instance, leaf, stored.statics ? instance : leaf};
  }
};

}  // namespace cab
