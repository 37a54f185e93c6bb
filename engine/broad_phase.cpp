#include "engine/broad_phase.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace cab {
namespace {

// Rounding of origin + bound in double, as a fraction of their magnitudes: docs/proof.md, step 4.4, a little over 2^-52.
constexpr double kWorldPad = 0x1p-51;

// Instances that one task counts or places.
constexpr std::uint32_t kInstancesPerTask = 1024;

// Cells are no smaller than this fraction of the world's extent, so that cell numbers stay small.
constexpr int kFinestCell = 20;

// One instance in this many may be too large for the lowest level.
constexpr std::uint32_t kLargeShare = 32;

// An axis along which the instances spread over fewer cells than this is flat.
constexpr double kFlatCells = 4;

bool paired(const Engine& engine, std::uint32_t a, std::uint32_t b) {
  const std::size_t bit = std::size_t{a} * engine.batches.size() + b;
  return engine.paired_bits[bit >> 6] >> (bit & 63) & 1;
}

void set_paired(Engine& engine, std::uint32_t a, std::uint32_t b) {
  const std::size_t bit = std::size_t{a} * engine.batches.size() + b;
  engine.paired_bits[bit >> 6] |= std::uint64_t{1} << (bit & 63);
  engine.batches[a]->batch.pairs_between = true;
}

bool meet(const InstanceBounds& a, const InstanceBounds& b) {
  return (a.lo[0] <= b.hi[0]) & (b.lo[0] <= a.hi[0]) & (a.lo[1] <= b.hi[1]) & (b.lo[1] <= a.hi[1]) &
         (a.lo[2] <= b.hi[2]) & (b.lo[2] <= a.hi[2]);
}

// The least e such that every value up to `extent` is below 2^e.
int exponent_above(double extent) {
  std::uint64_t bits;
  std::memcpy(&bits, &extent, sizeof bits);
  const int exponent = static_cast<int>(bits >> 52 & 0x7ff) - 1022;  // extents are never negative
  return std::clamp(exponent, GridSurvey::kLeastExponent, GridSurvey::kMostExponent);
}

std::uint32_t level_of_exponent(const Grid& grid, int exponent) {
  const int above = exponent - grid.exponent[0];
  return above <= 0 ? 0 : std::min((static_cast<std::uint32_t>(above) + 1) / 2, kGridLevels - 1);
}

std::uint32_t level_of(const Grid& grid, const InstanceBounds& bounds) {
  double extent = 0;
  for (std::uint32_t c = 0; c < 3; ++c)
    if (!grid.flat[c]) extent = std::max(extent, bounds.hi[c] - bounds.lo[c]);
  return level_of_exponent(grid, exponent_above(extent));
}

// The number of the cell that holds a coordinate. Cells are powers of two, so nothing is rounded but to below.
std::int64_t cell_of(const Grid& grid, std::uint32_t level, std::uint32_t axis, double at) {
  if (grid.flat[axis]) return 0;
  constexpr double most = 0x1p61;
  const double scaled = std::clamp(at * grid.scale[level], -most, most);
  const std::int64_t whole = static_cast<std::int64_t>(scaled);
  return whole - (static_cast<double>(whole) > scaled);
}

// Cells that follow each other along x have buckets that follow each other.
std::uint32_t bucket_of(const Grid& grid, std::uint32_t level, std::int64_t x, std::int64_t y, std::int64_t z) {
  const std::uint64_t hash = static_cast<std::uint64_t>(x) + static_cast<std::uint64_t>(y) * 0x9e3779b97f4a7c15u +
                             static_cast<std::uint64_t>(z) * 0xc2b2ae3d27d4eb4fu +
                             std::uint64_t{level} * 0x165667b19e3779f9u;
  return static_cast<std::uint32_t>(hash) & grid.mask;
}

std::uint32_t bucket_of(const Grid& grid, const InstanceBounds& bounds, std::uint32_t level) {
  return bucket_of(grid, level, cell_of(grid, level, 0, bounds.lo[0]), cell_of(grid, level, 1, bounds.lo[1]),
                   cell_of(grid, level, 2, bounds.lo[2]));
}

// Runs body(batch index, instance, worker) for every instance that some rule tests against others.
template <class Body>
void for_each_instance(Engine& engine, Body&& body) {
  for (std::uint32_t index = 0; index < engine.batches.size(); ++index) {
    const InstanceBatch& batch = engine.batches[index]->batch;
    if (!batch.pairs_between) continue;
    engine.schedule->for_each((batch.instance_count + kInstancesPerTask - 1) / kInstancesPerTask,
                              [&](std::uint32_t task, std::uint32_t worker) {
                                const std::uint32_t end =
                                    std::min(batch.instance_count, (task + 1) * kInstancesPerTask);
                                for (std::uint32_t i = task * kInstancesPerTask; i < end; ++i)
                                  if (batch.live[i / kLanes] >> (i % kLanes) & 1) body(index, i, worker);
                              });
  }
}

// Adds to a counter that all workers share; returns what it held.
std::uint32_t shared_add(std::uint32_t& counter, std::uint32_t amount, bool alone) {
  if (!alone) return __atomic_fetch_add(&counter, amount, __ATOMIC_RELAXED);
  const std::uint32_t before = counter;
  counter += amount;
  return before;
}

// How far instances spread and how large they are, over all workers.
GridSurvey survey_instances(Engine& engine) {
  const std::size_t working = engine.schedule->alone ? 1 : engine.workers.size();
  for (std::size_t w = 0; w < working; ++w) engine.workers[w]->survey = {};
  for_each_instance(engine, [&](std::uint32_t index, std::uint32_t instance, std::uint32_t w) {
    GridSurvey& survey = engine.workers[w]->survey;
    const InstanceBounds& bounds = engine.batches[index]->batch.bounds[instance];
    for (std::uint32_t c = 0; c < 3; ++c) {
      survey.lo[c] = std::min(survey.lo[c], bounds.lo[c]);
      survey.hi[c] = std::max(survey.hi[c], bounds.lo[c]);
      ++survey.of_exponent[c][exponent_above(bounds.hi[c] - bounds.lo[c]) - GridSurvey::kLeastExponent];
    }
    ++survey.count;
  });
  GridSurvey all = engine.workers[0]->survey;
  for (std::size_t w = 1; w < working; ++w) {
    const GridSurvey& part = engine.workers[w]->survey;
    for (std::uint32_t c = 0; c < 3; ++c) {
      all.lo[c] = std::min(all.lo[c], part.lo[c]);
      all.hi[c] = std::max(all.hi[c], part.hi[c]);
      for (std::uint32_t e = 0; e < GridSurvey::kExponents; ++e) all.of_exponent[c][e] += part.of_exponent[c][e];
    }
    all.count += part.count;
  }
  return all;
}

// Chooses the cells: axes along which the instances spread over few of their own sizes are left out, and the lowest
// level fits nearly all instances along the others.
void choose_levels(const GridSurvey& survey, Grid& grid) {
  int lowest = GridSurvey::kLeastExponent, largest = GridSurvey::kLeastExponent;
  bool endless = false;  // bounds without an end (origins at the end of double's range) have no cell
  for (std::uint32_t c = 0; c < 3; ++c) {
    int common = GridSurvey::kLeastExponent, most = common;
    std::uint32_t below = 0;
    for (std::uint32_t e = 0; e < GridSurvey::kExponents; ++e) {
      const int exponent = static_cast<int>(e) + GridSurvey::kLeastExponent;
      below += survey.of_exponent[c][e];
      if (below < survey.count - survey.count / kLargeShare) common = exponent + 1;
      if (survey.of_exponent[c][e]) most = exponent;
    }
    const double spread = survey.hi[c] - survey.lo[c];
    endless = endless || most == GridSurvey::kMostExponent;
    grid.flat[c] = !(spread > kFlatCells * std::ldexp(1.0, common));
    if (grid.flat[c]) continue;
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
  for (bool& flat : grid.flat) flat = flat || endless;
}

void note_rules(Engine& engine, const FrameJob& job) {
  std::fill(engine.paired_bits.begin(), engine.paired_bits.end(), std::uint64_t{0});
  for (const PairRule& rule : job.rules) {
    if (engine.batch(rule.a).kind != BatchKind::kCharacters) continue;
    if (rule.pairing == Pairing::kWithin) {
      engine.batch(rule.a).pairs_within = true;
    } else {
      set_paired(engine, rule.a.value - 1, rule.b.value - 1);
      set_paired(engine, rule.b.value - 1, rule.a.value - 1);
    }
  }
}

// Rounded to float, away from the inside of the bounds.
float rounded_down(double value) { return static_cast<float>(value - 0x1p-22 * std::fabs(value)); }

// Bounds about the grid's origin. What float rounds only lets more rows meet, which their bounds in double tell apart.
BoundsRow row_of(const Grid& grid, const InstanceBounds& bounds, std::uint32_t batch, std::uint32_t instance) {
  BoundsRow out;
  for (std::uint32_t c = 0; c < 3; ++c) {
    out.side[c] = rounded_down(bounds.lo[c] - grid.origin[c]);
    out.side[3 + c] = rounded_down(grid.origin[c] - bounds.hi[c]);
  }
  out.batch = batch;
  out.instance = instance;
  return out;
}

// What a search of the grid looks for, and where it puts it.
struct Search {
  const Engine& engine;
  const InstanceBounds& bounds;
  float reach[8];  // of kernels' meeting_rows
  std::uint32_t batch;
  std::uint64_t above, below;  // keys to list lie between these two
  bool every_row = false;      // of the grid is scanned: a full list ends the search
  FixedList<Partner>& found;
  bool complete = true;
};

// Ascending, each once: cells that wrap around the buckets may be scanned twice.
void sort_partners(FixedList<Partner>& list) {
  std::sort(list.begin(), list.end(), [](const Partner& x, const Partner& y) { return x.key < y.key; });
  list.size = static_cast<std::uint32_t>(
      std::unique(list.begin(), list.end(), [](const Partner& x, const Partner& y) { return x.key == y.key; }) -
      list.begin());
}

// Keeps the lower half of a full list, and from then on takes only what lies below its end.
void keep_lower_half(Search& search) {
  FixedList<Partner>& found = search.found;
  sort_partners(found);
  if (found.size <= found.capacity / 2) return;
  found.size = found.capacity / 2;
  search.below = found.data[found.size - 1].key;
  search.complete = false;
}

void scan_rows(Search& search, std::uint32_t first, std::uint32_t end) {
  constexpr std::uint32_t kAtOnce = 128;
  const Engine& engine = search.engine;
  std::uint32_t meeting[kAtOnce + 1];
  for (; first < end; first += std::min(kAtOnce, end - first)) {
    const BoundsRow* const rows = engine.grid.rows.data + first;
    const std::uint32_t count =
        engine.kernels->meeting_rows(rows, std::min(kAtOnce, end - first), search.reach, meeting);
    for (std::uint32_t m = 0; m < count; ++m) {
      const BoundsRow& row = rows[meeting[m]];
      const std::uint64_t key = instance_key(row.batch, row.instance);
      if (key <= search.above || key >= search.below || !paired(engine, search.batch, row.batch)) continue;
      if (!meet(search.bounds, engine.grid.placements[first + meeting[m]].bounds)) continue;
      search.found.push({key, first + meeting[m]});
      if (search.found.size < search.found.capacity) continue;
      if (search.every_row) {
        search.complete = false;
        return;
      }
      keep_lower_half(search);
    }
  }
}

// Scans the cells of one level in which an instance may begin whose bounds meet the ones searched for: from one cell
// before the first that they touch. False when those are more than there are rows.
bool scan_level(Search& search, std::uint32_t level) {
  const Grid& grid = search.engine.grid;
  std::int64_t lo[3], hi[3];
  double cells = 1;
  for (std::uint32_t c = 0; c < 3; ++c) {
    lo[c] = cell_of(grid, level, c, search.bounds.lo[c]) - (grid.flat[c] ? 0 : 1);
    hi[c] = cell_of(grid, level, c, search.bounds.hi[c]);
    cells *= static_cast<double>(hi[c] - lo[c] + 1);
  }
  if (cells > 64 + static_cast<double>(grid.count)) return false;
  const std::uint32_t length = static_cast<std::uint32_t>(hi[0] - lo[0] + 1);
  if (length > grid.mask) return false;
  for (std::int64_t z = lo[2]; z <= hi[2]; ++z)
    for (std::int64_t y = lo[1]; y <= hi[1]; ++y) {
      const std::uint32_t first = bucket_of(grid, level, lo[0], y, z);
      const std::uint32_t fits = std::min(length, grid.mask + 1 - first);
      scan_rows(search, grid.bucket[first], grid.bucket[first + fits]);
      if (fits < length) scan_rows(search, 0, grid.bucket[length - fits]);
    }
  return true;
}

// Looks at every instance in the order of keys, so that after a full list the next goes on where it ended.
bool list_in_order(const Engine& engine, std::uint32_t batch, const InstanceBounds& bounds, std::uint64_t after,
                   bool all, FixedList<Partner>& found) {
  found.clear();
  std::uint32_t instance = static_cast<std::uint32_t>(after) + 1;
  for (auto index = static_cast<std::uint32_t>(after >> 32); index < engine.batches.size(); ++index, instance = 0) {
    if (!paired(engine, batch, index)) continue;
    const InstanceBatch& other = engine.batches[index]->batch;
    for (; instance < other.instance_count; ++instance) {
      if (!(other.live[instance / kLanes] >> (instance % kLanes) & 1)) continue;
      if (!all && !meet(bounds, other.bounds[instance])) continue;
      if (found.size == found.capacity) return false;
      found.push({instance_key(index, instance), kNoRow});
    }
  }
  return true;
}

}  // namespace

void bound_instances(const Engine& engine, InstanceBatch& batch, std::uint32_t tile, const AabbTile* leaves) {
  AabbTile all;
  engine.kernels->bound_together(leaves, batch.articulation->leaf_count, &all);
  const std::uint32_t first = tile * kLanes;
  const std::uint32_t live = std::min(kLanes, batch.instance_count - first);
  for (std::uint32_t lane = 0; lane < live; ++lane) {
    InstanceBounds& out = batch.bounds[first + lane];
    for (std::uint32_t c = 0; c < 3; ++c) {
      const double origin = origin_of(batch, first + lane, c);
      const double lo = static_cast<double>(all.lo[c][lane]), hi = static_cast<double>(all.hi[c][lane]);
      const double pad = kWorldPad * (std::fabs(origin) + std::max(std::fabs(lo), std::fabs(hi)));
      out.lo[c] = origin + lo - pad;
      out.hi[c] = origin + hi + pad;
    }
  }
}

void build_grid(Engine& engine, const FrameJob& job) {
  note_rules(engine, job);
  Grid& grid = engine.grid;
  const GridSurvey survey = survey_instances(engine);
  grid.count = survey.count;
  if (survey.count == 0) return;
  choose_levels(survey, grid);
  grid.mask = 15;
  while (grid.mask + 1 < survey.count) grid.mask = 2 * grid.mask + 1;
  const bool alone = engine.schedule->alone || engine.workers.size() == 1;
  std::fill(grid.bucket.data, grid.bucket.data + grid.mask + 2, 0u);
  for_each_instance(engine, [&](std::uint32_t index, std::uint32_t instance, std::uint32_t) {
    const InstanceBounds& bounds = engine.batches[index]->batch.bounds[instance];
    const std::uint32_t level = level_of(grid, bounds);
    if (!grid.used[level].load(std::memory_order_relaxed)) grid.used[level].store(true, std::memory_order_relaxed);
    shared_add(grid.bucket[bucket_of(grid, bounds, level)], 1, alone);
  });
  std::uint32_t sum = 0;
  for (std::uint32_t b = 0; b <= grid.mask + 1; ++b) sum = grid.bucket[b] += sum;
  for (std::uint32_t c = 0; c < 3; ++c) grid.origin[c] = 0.5 * survey.lo[c] + 0.5 * survey.hi[c];
  // Each bucket now holds its end; placing its rows from there down leaves its beginning.
  for_each_instance(engine, [&](std::uint32_t index, std::uint32_t instance, std::uint32_t) {
    const InstanceBounds& bounds = engine.batches[index]->batch.bounds[instance];
    const std::uint32_t at = shared_add(grid.bucket[bucket_of(grid, bounds, level_of(grid, bounds))], ~0u, alone) - 1;
    grid.rows[at] = row_of(grid, bounds, index, instance);
    grid.placements[at] = placement_of(engine.batches[index]->batch, instance);
  });
}

bool find_partners(const Engine& engine, std::uint32_t batch, const InstanceBounds& bounds, std::uint64_t after,
                   bool all, Worker& worker) {
  FixedList<Partner>& found = worker.partners;
  if (all) return list_in_order(engine, batch, bounds, after, all, found);
  found.clear();
  Search search = {engine, bounds, {}, batch, after, ~std::uint64_t{0}, false, found};
  const BoundsRow row = row_of(engine.grid, bounds, 0, 0);
  for (std::uint32_t c = 0; c < 6; ++c) search.reach[c] = -row.side[(c + 3) % 6];
  for (std::uint32_t level = 0; level < kGridLevels; ++level)
    if (engine.grid.used[level].load(std::memory_order_relaxed) && !scan_level(search, level)) {
      search.every_row = true;
      break;
    }
  if (search.every_row) {  // few partners are found faster by rows, many in order
    found.clear();
    search.below = ~std::uint64_t{0};
    search.complete = true;
    scan_rows(search, 0, engine.grid.count);
    if (!search.complete) return list_in_order(engine, batch, bounds, after, all, found);
  }
  sort_partners(found);
  return search.complete;
}

}  // namespace cab
