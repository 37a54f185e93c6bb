// Step 2 of a frame: which instances of character batches come near each other, by the bounds of their leaf boxes. A
// hashed grid without limits: an instance is kept in the one cell where its bounds begin, on the level whose cells are
// no smaller than it.
#pragma once

#include "engine/broad_phase/grid.h"
#include "engine/broad_phase/partner.h"
#include "engine/frame_context.h"
#include "engine/worker.h"

namespace cab {

// Notes which batches the rules pair. Instances are bounded next.
void begin_broad_phase(Span<const PairRule> rules, Span<const std::unique_ptr<BatchSlot>> slots, BroadPhase& broad,
                       WorkerPool& pool);

// Bounds of a tile's instances in the world from bounds of their leaves, widened by what forming them in double rounds.
// What the grid must know of all of them is added to the histogram. Who is masked is known.
void bound_instances(const kernel::KernelTable& kernels, InstanceBatch& batch, std::uint32_t tile,
                     const AabbTile* leaves, ExtentHistogram& histogram);

// Puts every instance that the rules test against others into the grid.
void build_grid(Span<const std::unique_ptr<BatchSlot>> slots, Grid& grid, WorkerPool& pool);

// What partners are looked for: instances above the key `after`, with whose batch a rule pairs `batch`, whose bounds
// overlap `bounds`; all of them where `all` asks for tests without boxes.
struct PartnerQuery {
  std::uint32_t batch;
  const InstanceBounds& bounds;
  std::uint64_t after;
  bool all;
};

// Lists the partners in ascending order of keys. False when the list is full and there may be more above its last.
bool find_partners(const FrameContext& frame, const PartnerQuery& query, FixedList<Partner>& found);

}  // namespace cab
