// The frame context: what all steps of a frame read.
#pragma once

#include "engine/step/stored_batch.h"
#include "kernels/kernel_table.h"

namespace cab {

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
  bool containment = false;  // FrameJob::containment
  // Whether the store already has the hits of two that rest, and of one within itself (keep_hits): they are no
  // candidates.
  bool keeps_hits = false;

  const InstanceBatch& batch(std::uint32_t index) const { return batches[index]->batch; }

  // Whether the frame asks for what is inside the skins of others.
  bool finds_inside() const { return containment && policies.exact == Exact::kSurface; }

  // Whether one overlapping leaf pair is all that a candidate is tested for: the frame asks only which instances are in
  // contact, and no exact test follows.
  bool first_only() const { return report == Report::kInContact && policies.exact == Exact::kNone; }
};

}  // namespace cab
