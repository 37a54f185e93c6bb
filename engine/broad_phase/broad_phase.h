// Step 2 of a frame: finds the instances of character batches whose bounds overlap.
// The bounds are in a grid of hashed cells, so the world has no limits. An instance is stored in one cell: the cell of
// its lower bounds, on the lowest level whose cells are larger than the instance.
#pragma once

#include "engine/broad_phase/grid.h"
#include "engine/broad_phase/partner.h"
#include "engine/frame_context.h"
#include "engine/worker.h"

namespace cab {

// Starts the step: records which batches the rules pair and clears the histograms of the workers. bound_instances comes
// next.
void begin_broad_phase(Span<const PairRule> rules, StoredBatches batches, BroadPhase& broad, WorkerPool& pool);

// The bounds of an instance in the world: its origin plus `all`, the bounds of its leaf boxes relative to the origin in
// one lane of a tile, widened by the rounding of these sums.
InstanceBounds world_bounds(const InstanceBatch& batch, std::uint32_t instance, const AabbTile& all,
                            std::uint32_t lane);

// Stores the world bounds of a tile's instances: the origin plus the bounds of the leaf boxes, widened by the rounding
// of this sum in double. live: the bits of the lanes that are not masked. Adds every live instance that the grid will
// hold to the histogram.
void bound_instances(const kernel::KernelTable& kernels, InstanceBatch& batch, const TileInstances& instances,
                     std::uint32_t live, const AabbTile* leaves, ExtentHistogram& histogram);

// The world bounds of an instance by the bounds that the caller gives for it. They hold those of bound_instances with a
// margin, if the caller's hold the leaf boxes of compute_boxes.
InstanceBounds given_bounds(const InstanceBatch& batch, std::uint32_t instance, float margin);

// Stores the given bounds of a tile's instances, and adds them to the histogram as bound_instances does.
void take_given_bounds(InstanceBatch& batch, const TileInstances& instances, float margin, ExtentHistogram& histogram);

// The same for one live instance that rests, and whose bounds are those of an earlier frame.
void keep_bounds(const InstanceBatch& batch, std::uint32_t instance, Worker& worker);

// The steps that put every live instance of the batches that some rule pairs with others into one of the grids. Where a
// step begins, the tasks of the one before have ended; it returns its number of tasks.
//
// First, in some frames, the instances that rest are noted for the kept grid. It is then built as the other grid is.
std::uint32_t begin_keeping(StoredBatches batches, BroadPhase& broad, WorkerPool& pool);
void keep_entries(StoredBatches batches, std::uint32_t task, Worker& worker);
std::uint32_t begin_counting_kept(StoredBatches batches, BroadPhase& broad, WorkerPool& pool);

// Counts the entries of each bucket. Then entries are inserted.
std::uint32_t begin_counting(StoredBatches batches, BroadPhase& broad, WorkerPool& pool);
void count_entries(StoredBatches batches, const BroadPhase& broad, Grid& grid, std::uint32_t task, Worker& worker);
std::uint32_t begin_inserting(StoredBatches batches, const BroadPhase& broad, Grid& grid, WorkerPool& pool);
void insert_entries(StoredBatches batches, const BroadPhase& broad, Grid& grid, std::uint32_t task, Worker& worker);

// What find_partners looks for: live instances of the batches that a rule pairs with `batch`, with a key above `after`
// and with bounds that overlap `bounds`.
struct PartnerQuery {
  std::uint32_t batch;  // index of the batch
  const InstanceBounds& bounds;
  std::uint64_t after;  // an instance_key
};

// Replaces `found` by the partners in ascending order of their keys. Returns false if the list is full and partners
// with higher keys may follow. Then the next query starts after the last key.
bool find_partners(const FrameContext& frame, const PartnerQuery& query, FixedList<Partner>& found);

}  // namespace cab
