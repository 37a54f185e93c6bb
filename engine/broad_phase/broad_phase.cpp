// Step 2 of a frame: builds the grid from the bounds of the instances, and lists partners in the order of keys.
#include "engine/broad_phase/broad_phase.h"

#include "engine/batch_tasks.h"
#include "engine/broad_phase/search.h"
#include "engine/timed.h"
#include "layout/atomic_words.h"
#include "layout/error_bounds.h"

#include <algorithm>
#include <cmath>

namespace cab {
namespace {

// How many instances one task counts or inserts.
constexpr std::uint32_t kInstancesPerTask = 1024;

// Cells are at least 2^-kFinestCell as wide as the spread of the instances, so that cell indices stay small.
constexpr int kFinestCell = 20;

// Along each axis, at most one instance in kLargeShare is too large for the cells of the lowest level.
constexpr std::uint32_t kLargeShare = 32;

// The grid does not use an axis along which the instances spread over at most this many cells.
constexpr double kLeastCells = 4;

// Records that a rule pairs batch a with batch b, and so that batch a belongs into a grid.
void set_paired(StoredBatches batches, std::uint32_t a, std::uint32_t b, Resting resting, BroadPhase& broad) {
  const std::size_t bit = a * broad.batch_count + b;
  const std::uint64_t mask = std::uint64_t{1} << (bit & 63);
  broad.paired_bits[bit >> 6] |= mask;
  if (resting == Resting::kSkipped) broad.skipped_bits[bit >> 6] |= mask;
  batches[a]->batch.pairs_between = true;
}

// One task for every kInstancesPerTask instances of the batches that some rule pairs with others.
std::uint32_t instance_tasks(StoredBatches batches) {
  return lay_out_tasks(batches, [](const InstanceBatch& batch) {
    return batch.pairs_between ? (batch.instance_count + kInstancesPerTask - 1) / kInstancesPerTask : 0;
  });
}

// Calls body(batch index, batch, instance) for every live instance of a task.
template <class Body>
void for_each_instance(StoredBatches batches, std::uint32_t task, Body&& body) {
  const BatchTask of = batch_task(batches, task);
  InstanceBatch& batch = batches[of.batch]->batch;
  const std::uint32_t end = std::min(batch.instance_count, (of.run + 1) * kInstancesPerTask);
  for (std::uint32_t i = of.run * kInstancesPerTask; i < end; ++i)
    if (batch.live[i / kLanes] >> (i % kLanes) & 1) body(of.batch, batch, i);
}

// Counts the time of a scope for the grids.
struct TimedGrid {
  explicit TimedGrid(FrameStats& stats) : broad(stats.seconds_broad), grid(stats.seconds_grid) {}
  Timed broad, grid;
};

// Adds to a counter that all workers share, and returns its value before the addition. If the worker is alone, a plain
// addition suffices.
std::uint32_t shared_add(std::uint32_t& counter, std::uint32_t amount, bool alone) {
  if (!alone) return relaxed_add(counter, amount);
  const std::uint32_t before = counter;
  counter += amount;
  return before;
}

// Counts one instance in a histogram.
void add_to_histogram(const InstanceBounds& bounds, ExtentHistogram& histogram) {
  for (std::uint32_t c = 0; c < 3; ++c) {
    histogram.lo[c] = std::min(histogram.lo[c], bounds.lo[c]);
    histogram.hi[c] = std::max(histogram.hi[c], bounds.lo[c]);
    ++histogram.count_by_exponent[c][exponent_above(bounds.hi[c] - bounds.lo[c]) - ExtentHistogram::kLeastExponent];
  }
  ++histogram.count;
}

void add_histogram(const ExtentHistogram& part, ExtentHistogram& sum) {
  if (part.count == 0) return;
  for (std::uint32_t c = 0; c < 3; ++c) {
    sum.lo[c] = std::min(sum.lo[c], part.lo[c]);
    sum.hi[c] = std::max(sum.hi[c], part.hi[c]);
    for (std::uint32_t e = 0; e < ExtentHistogram::kExponents; ++e)
      sum.count_by_exponent[c][e] += part.count_by_exponent[c][e];
  }
  sum.count += part.count;
}

// Adds the histograms of all workers to that of the first, which it returns, and empties the others.
ExtentHistogram& take_histograms(const WorkerPool& pool, ExtentHistogram Worker::*member) {
  ExtentHistogram& sum = pool[0].*member;
  for (std::uint32_t w = 1; w < pool.working_count(); ++w) {
    ExtentHistogram& part = pool[w].*member;
    if (part.count == 0) continue;
    add_histogram(part, sum);
    part = {};
  }
  return sum;
}

// Chooses the used axes and the widths of the cells. An axis is unused if the instances spread over few cells along it
// (kLeastCells). Along the other axes, the cells of the lowest level hold nearly all instances (kLargeShare).
void choose_levels(const ExtentHistogram& histogram, Grid& grid) {
  int lowest = ExtentHistogram::kLeastExponent, largest = ExtentHistogram::kLeastExponent;
  bool endless = false;  // whether an extent is 2^1023 or more (origins near the end of double's range)
  for (std::uint32_t c = 0; c < 3; ++c) {
    int common = ExtentHistogram::kLeastExponent, most = common;
    std::uint32_t below = 0;
    for (std::uint32_t e = 0; e < ExtentHistogram::kExponents; ++e) {
      const int exponent = static_cast<int>(e) + ExtentHistogram::kLeastExponent;
      below += histogram.count_by_exponent[c][e];
      if (below < histogram.count - histogram.count / kLargeShare) common = exponent + 1;
      if (histogram.count_by_exponent[c][e]) most = exponent;
    }
    const double spread = histogram.hi[c] - histogram.lo[c];
    endless = endless || most == ExtentHistogram::kMostExponent;
    grid.unused_axis[c] = !(spread > kLeastCells * std::ldexp(1.0, common));
    if (grid.unused_axis[c]) continue;
    lowest = std::max({lowest, common, exponent_above(spread) - kFinestCell});
    largest = std::max(largest, most);
  }
  for (std::uint32_t level = 0; level < kGridLevels; ++level) {
    int exponent = lowest + 2 * static_cast<int>(level);
    if (level == kGridLevels - 1) exponent = std::max(exponent, largest);
    grid.exponent[level] = exponent;
    grid.scale[level] = std::ldexp(1.0, -exponent);
    grid.used[level] = false;
  }
  // Such an extent has no cell that is larger, so the grid becomes a single cell per level.
  for (bool& unused : grid.unused_axis) unused = unused || endless;
}

// Chooses the cells of a grid for the instances of a histogram, and empties its buckets. Returns the number of tasks
// that count the instances of each bucket.
std::uint32_t begin_grid(StoredBatches batches, const ExtentHistogram& histogram, Grid& grid, const WorkerPool& pool) {
  grid.count = histogram.count;
  if (histogram.count == 0) return 0;
  choose_levels(histogram, grid);
  for (std::uint32_t c = 0; c < 3; ++c) grid.origin[c] = 0.5 * histogram.lo[c] + 0.5 * histogram.hi[c];
  grid.mask = 15;
  while (grid.mask + 1 < histogram.count) grid.mask = 2 * grid.mask + 1;
  std::fill(grid.bucket.data, grid.bucket.data + grid.mask + 2, 0u);
  grid.alone = pool.working_count() == 1;
  return instance_tasks(batches);
}

// Records the rules of characters in their batches and in `broad`.
void note_rules(Span<const PairRule> rules, StoredBatches batches, BroadPhase& broad) {
  std::fill(broad.paired_bits.begin(), broad.paired_bits.end(), std::uint64_t{0});
  std::fill(broad.skipped_bits.begin(), broad.skipped_bits.end(), std::uint64_t{0});
  broad.reports_resting = false;
  for (const PairRule& rule : rules) {
    const std::uint32_t a = slot_of(rule.a).value - 1, b = slot_of(rule.b).value - 1;
    if (batches[a]->batch.kind != BatchKind::kCharacters) continue;
    const bool may_rest = batches[a]->batch.may_rest && batches[b]->batch.may_rest;
    broad.reports_resting = broad.reports_resting || (may_rest && rule.resting == Resting::kReported);
    if (rule.pairing == Pairing::kWithin) {
      batches[a]->batch.pairs_within = true;
      batches[a]->batch.skips_within = rule.resting == Resting::kSkipped;
    } else {
      set_paired(batches, a, b, rule.resting, broad);
      set_paired(batches, b, a, rule.resting, broad);
    }
  }
}

// The partners that a search has found. It takes only keys between `above` and `below`, both excluded.
struct PartnerList {
  FixedList<Partner>& found;
  std::uint64_t above, below;
  bool complete = true;  // false once partners were dropped
};

// Sorts partners by key and keeps each once: a search scans a bucket twice if two of its cells share it.
void sort_partners(FixedList<Partner>& list) {
  std::sort(list.begin(), list.end(), [](const Partner& x, const Partner& y) { return x.key < y.key; });
  list.size = static_cast<std::uint32_t>(
      std::unique(list.begin(), list.end(), [](const Partner& x, const Partner& y) { return x.key == y.key; }) -
      list.begin());
}

// Makes room in a full list. Removing duplicates may suffice. Else the upper half of the partners is dropped, and the
// search takes no more keys above the remaining ones.
void keep_lower_half(PartnerList& list) {
  sort_partners(list.found);
  if (list.found.size <= list.found.capacity / 2) return;
  list.found.size = list.found.capacity / 2;
  list.below = list.found.data[list.found.size - 1].key;
  list.complete = false;
}

// Lists partners without the grid: compares the query with every instance in the order of keys. Returns false when the
// list is full; the next query then goes on after its last key.
bool list_in_key_order(const FrameContext& frame, const PartnerQuery& query, FixedList<Partner>& found) {
  found.clear();
  std::uint32_t instance = static_cast<std::uint32_t>(query.after) + 1;
  for (auto index = static_cast<std::uint32_t>(query.after >> 32); index < frame.batches.size; ++index, instance = 0) {
    if (!frame.broad_phase.paired(query.batch, index)) continue;
    const InstanceBatch& other = frame.batch(index);
    for (; instance < other.instance_count; ++instance) {
      if (!(other.live[instance / kLanes] >> (instance % kLanes) & 1)) continue;
      if (!overlap(query.bounds, other.bounds[instance])) continue;
      if (found.size == found.capacity) return false;
      found.push({instance_key(index, instance), kNoEntry});
    }
  }
  return true;
}

// Adds the partners in one grid to the list. Returns false if that takes a scan of all entries, and they do not fit:
// the order of keys is then faster.
bool search_grid(const FrameContext& frame, const PartnerQuery& query, const Grid& grid, PartnerList& list) {
  if (grid.count == 0) return true;
  const bool kept = &grid == &frame.broad_phase.kept;
  const bool every_entry = !is_worth_searching(grid, query.bounds);
  GridEntry own;
  set_entry(grid, query.bounds, query.batch, 0, own);
  const auto take = [&](std::uint32_t entry) {
    const GridEntry& other = grid.entries[entry];
    const std::uint64_t key = instance_key(other.batch, other.instance);
    if (key <= list.above || key >= list.below || !frame.broad_phase.paired(query.batch, other.batch) ||
        (kept && !is_kept(frame, other)) || !overlap(query.bounds, grid.placements[entry].bounds))
      return true;
    list.found.push({key, entry});
    if (list.found.size < list.found.capacity) return true;
    if (every_entry) return false;
    keep_lower_half(list);
    return true;
  };
  if (every_entry) return scan_entries(frame, own, grid.first, grid.first + grid.count, take);
  for (std::uint32_t l = 0; l < grid.level_count; ++l)
    for_each_run(grid, grid.levels[l], cells_to_search(grid, grid.levels[l], query.bounds),
                 [&](std::uint32_t first, std::uint32_t end, std::int64_t, std::int64_t) {
                   return scan_entries(frame, own, first, end, take);
                 });
  return true;
}

}  // namespace

void begin_broad_phase(Span<const PairRule> rules, StoredBatches batches, BroadPhase& broad, WorkerPool& pool) {
  note_rules(rules, batches, broad);
  for (const auto& worker : pool.workers) {
    for (ExtentHistogram* const histogram : {&worker->histogram, &worker->resting})
      if (histogram->count > 0) *histogram = {};
    worker->kept = 0;
  }
}

InstanceBounds world_bounds(const InstanceBatch& batch, std::uint32_t instance, const AabbTile& all,
                            std::uint32_t lane) {
  InstanceBounds out;
  for (std::uint32_t c = 0; c < 3; ++c) {
    const double origin = origin_of(batch, instance, c);
    const double lo = static_cast<double>(all.lo[c][lane]), hi = static_cast<double>(all.hi[c][lane]);
    const double pad = kWorldPad * (std::fabs(origin) + std::max(std::fabs(lo), std::fabs(hi)));
    out.lo[c] = origin + lo - pad;
    out.hi[c] = origin + hi + pad;
  }
  return out;
}

void bound_instances(const kernel::KernelTable& kernels, InstanceBatch& batch, const TileInstances& instances,
                     std::uint32_t live, const AabbTile* leaves, ExtentHistogram& histogram) {
  AabbTile all;
  kernels.bound_together(leaves, posed_articulation(*batch.active).leaf_count, &all);
  for (std::uint32_t lane = 0; lane < instances.count; ++lane) {
    const std::uint32_t instance = instances.instance[lane];
    InstanceBounds& out = batch.bounds[instance];
    out = world_bounds(batch, instance, all, lane);
    if (batch.pairs_between && (live >> lane & 1)) add_to_histogram(out, histogram);
  }
}

InstanceBounds given_bounds(const InstanceBatch& batch, std::uint32_t instance, float margin) {
  const float* const given = batch.input->bounds.data + 6 * std::size_t{instance};
  double most = 0;
  for (int side = 0; side < 6; ++side) most = std::max(most, std::fabs(static_cast<double>(given[side])));
  InstanceBounds out;
  for (std::uint32_t c = 0; c < 3; ++c) {
    const double origin = origin_of(batch, instance, c);
    const double pad = kGivenPad * most + kGivenMargin * static_cast<double>(margin_of(batch, instance, margin)) +
                       kWorldPad * (std::fabs(origin) + most);
    out.lo[c] = origin + static_cast<double>(given[c]) - pad;
    out.hi[c] = origin + static_cast<double>(given[3 + c]) + pad;
  }
  return out;
}

void take_given_bounds(InstanceBatch& batch, const TileInstances& instances, float margin, ExtentHistogram& histogram) {
  for (std::uint32_t lane = 0; lane < instances.count; ++lane) {
    InstanceBounds& out = batch.bounds[instances.instance[lane]];
    out = given_bounds(batch, instances.instance[lane], margin);
    if (batch.pairs_between) add_to_histogram(out, histogram);
  }
}

void keep_bounds(const InstanceBatch& batch, std::uint32_t instance, Worker& worker) {
  if (!batch.pairs_between) return;
  if (batch.rest[instance] & kKept)
    ++worker.kept;
  else
    add_to_histogram(batch.bounds[instance], worker.resting);
}

std::uint32_t begin_keeping(StoredBatches batches, BroadPhase& broad, WorkerPool& pool) {
  const TimedGrid timed(pool[0].stats);
  std::uint32_t kept = 0;
  for (std::uint32_t w = 0; w < pool.working_count(); ++w) kept += pool[w].kept;
  ExtentHistogram& moving = take_histograms(pool, &Worker::histogram);
  const ExtentHistogram& resting = take_histograms(pool, &Worker::resting);
  const std::size_t spare = spare_entries(broad.instances);
  broad.keeps = resting.count > spare || broad.kept.count - kept > spare;
  if (broad.keeps) return instance_tasks(batches);
  add_histogram(resting, moving);
  return 0;
}

void keep_entries(StoredBatches batches, std::uint32_t task, Worker& worker) {
  const TimedGrid timed(worker.stats);
  for_each_instance(batches, task, [&](std::uint32_t, InstanceBatch& batch, std::uint32_t instance) {
    if (!rests(batch, instance)) return;
    if (batch.rest[instance] & kKept) add_to_histogram(batch.bounds[instance], worker.resting);
    batch.rest[instance] |= kKept;
  });
}

std::uint32_t begin_counting_kept(StoredBatches batches, BroadPhase& broad, WorkerPool& pool) {
  const TimedGrid timed(pool[0].stats);
  if (!broad.keeps) return 0;
  return begin_grid(batches, take_histograms(pool, &Worker::resting), broad.kept, pool);
}

std::uint32_t begin_counting(StoredBatches batches, BroadPhase& broad, WorkerPool& pool) {
  const TimedGrid timed(pool[0].stats);
  broad.grid.first = broad.kept.count;
  return begin_grid(batches, pool[0].histogram, broad.grid, pool);
}

void count_entries(StoredBatches batches, const BroadPhase& broad, Grid& grid, std::uint32_t task, Worker& worker) {
  const TimedGrid timed(worker.stats);
  const std::uint8_t kept = &grid == &broad.kept ? kKept : 0;
  for_each_instance(batches, task, [&](std::uint32_t, const InstanceBatch& batch, std::uint32_t instance) {
    if ((batch.rest[instance] & kKept) != kept) return;
    const InstanceBounds& bounds = batch.bounds[instance];
    const std::uint32_t level = level_of(grid, bounds);
    if (!grid.used[level].load(std::memory_order_relaxed)) grid.used[level].store(true, std::memory_order_relaxed);
    shared_add(grid.bucket[bucket_of(grid, bounds, level)], 1, grid.alone);
  });
}

std::uint32_t begin_inserting(StoredBatches batches, const BroadPhase& broad, Grid& grid, WorkerPool& pool) {
  if (grid.count == 0 || (&grid == &broad.kept && !broad.keeps)) return 0;
  const TimedGrid timed(pool[0].stats);
  grid.level_count = 0;
  for (std::uint32_t level = 0; level < kGridLevels; ++level)
    if (grid.used[level]) grid.levels[grid.level_count++] = level;
  grid.order_axis = !grid.unused_axis[2] ? 2 : !grid.unused_axis[1] ? 1 : 0;
  std::uint32_t sum = grid.first;
  for (std::uint32_t b = 0; b <= grid.mask + 1; ++b) sum = grid.bucket[b] += sum;
  return instance_tasks(batches);
}

// grid.bucket[b] is the end of bucket b at first. Each entry is inserted one below, so that afterwards it is the
// beginning.
void insert_entries(StoredBatches batches, const BroadPhase& broad, Grid& grid, std::uint32_t task, Worker& worker) {
  const TimedGrid timed(worker.stats);
  const std::uint8_t kept = &grid == &broad.kept ? kKept : 0;
  for_each_instance(batches, task, [&](std::uint32_t index, const InstanceBatch& batch, std::uint32_t instance) {
    if ((batch.rest[instance] & kKept) != kept) return;
    const InstanceBounds& bounds = batch.bounds[instance];
    const std::uint32_t at =
        shared_add(grid.bucket[bucket_of(grid, bounds, level_of(grid, bounds))], ~0u, grid.alone) - 1;
    set_entry(grid, bounds, index, instance, grid.entries[at]);
    grid.placements[at] = placement_of(batch, instance);
  });
}

bool find_partners(const FrameContext& frame, const PartnerQuery& query, FixedList<Partner>& found) {
  found.clear();
  PartnerList list = {found, query.after, ~std::uint64_t{0}};
  for (const Grid* const grid : {&frame.broad_phase.grid, &frame.broad_phase.kept})
    if (!search_grid(frame, query, *grid, list)) return list_in_key_order(frame, query, found);
  sort_partners(found);
  return list.complete;
}

}  // namespace cab
