// Step 2 of a frame: searches of the grid for entries whose bounds overlap.
#pragma once

#include "engine/candidate.h"
#include "engine/frame_context.h"

#include <cassert>

namespace cab {

// Whether two bounds overlap or touch.
inline bool overlap(const InstanceBounds& a, const InstanceBounds& b) {
  return (a.lo[0] <= b.hi[0]) & (b.lo[0] <= a.hi[0]) & (a.lo[1] <= b.hi[1]) & (b.lo[1] <= a.hi[1]) &
         (a.lo[2] <= b.hi[2]) & (b.lo[2] <= a.hi[2]);
}

// Whether the instance of an entry of the kept grid still rests.
inline bool is_kept(const FrameContext& frame, const GridEntry& entry) {
  return frame.batch(entry.batch).rest[entry.instance] & kKept;
}

// How many entries one call of the kernel compares.
inline constexpr std::uint32_t kEntriesPerCall = 128;

// Calls take(index) for every grid entry from `first` to `end` - 1 that overlaps `query`. Stops and returns false when
// take returns false.
template <class Take>
bool scan_entries(const FrameContext& frame, const GridEntry& query, std::uint32_t first, std::uint32_t end,
                  Take&& take) {
  std::uint32_t found[kEntriesPerCall + 1];
  for (; first < end; first += std::min(kEntriesPerCall, end - first)) {
    const std::uint32_t count = frame.kernels.overlapping_entries(frame.broad_phase.grid.entries.data, first,
                                                                  std::min(end, first + kEntriesPerCall), query, found);
    for (std::uint32_t i = 0; i < count; ++i)
      if (!take(found[i])) return false;
  }
  return true;
}

// The cells of one level from lo to hi, both included, along each axis.
struct CellRange {
  std::int64_t lo[3], hi[3];
};

// The cells of one level that hold the lower bounds of all instances which overlap `bounds`. No instance is wider than
// a cell, so they start one cell below those that `bounds` reach into.
inline CellRange cells_to_search(const Grid& grid, std::uint32_t level, const InstanceBounds& bounds) {
  CellRange out;
  for (std::uint32_t c = 0; c < 3; ++c) {
    out.lo[c] = cell_of(grid, level, c, bounds.lo[c]) - (grid.unused_axis[c] ? 0 : 1);
    out.hi[c] = cell_of(grid, level, c, bounds.hi[c]);
  }
  return out;
}

// Calls scan(first, end, y, z) for every run of entries that holds a line of cells along x. A line is split into two
// runs where the buckets wrap around, and must not have more cells than there are buckets. Since cells share buckets,
// runs may overlap and hold entries of other cells. Stops and returns false when scan returns false.
template <class Scan>
bool for_each_run(const Grid& grid, std::uint32_t level, const CellRange& cells, Scan&& scan) {
  const std::uint32_t length = static_cast<std::uint32_t>(cells.hi[0] - cells.lo[0] + 1);
  for (std::int64_t z = cells.lo[2]; z <= cells.hi[2]; ++z)
    for (std::int64_t y = cells.lo[1]; y <= cells.hi[1]; ++y) {
      const std::uint32_t first = bucket_of(grid, level, cells.lo[0], y, z);
      const std::uint32_t fits = std::min(length, grid.mask + 1 - first);
      if (!scan(grid.bucket[first], grid.bucket[first + fits], y, z)) return false;
      if (fits < length && !scan(grid.first, grid.bucket[length - fits], y, z)) return false;
    }
  return true;
}

// Whether entry x, and not y, reports the pair of the two, both on one level: the instance with the smaller lower bound
// on order_axis does. The entries decide if their floats differ, since rounding keeps the order. Ties and NaN fall back
// to the bounds in double, then to the keys.
inline bool is_before(const Grid& grid, std::uint32_t x, std::uint32_t y) {
  const std::uint32_t axis = grid.order_axis;
  const GridEntry &entry_x = grid.entries[x], &entry_y = grid.entries[y];
  if (entry_x.side[axis] < entry_y.side[axis]) return true;
  if (entry_x.side[axis] > entry_y.side[axis]) return false;
  const double from = grid.placements[x].bounds.lo[axis], to = grid.placements[y].bounds.lo[axis];
  if (from != to) return from < to;
  return instance_key(entry_x.batch, entry_x.instance) < instance_key(entry_y.batch, entry_y.instance);
}

// Calls take(other) for every entry of a grid that overlaps its entry `entry`, whose batch a rule pairs with its batch,
// and whose pair `entry` reports. Each pair is reported once: by the entry on the lower level, or as is_before says on
// one level. No instance is larger than the cells of its level and the levels above, so it searches at most three cells
// per axis. On its own level it leaves out the first cell along order_axis, whose instances report their pairs with it
// themselves.
template <class Take>
void for_each_later(const FrameContext& frame, const Grid& grid, std::uint32_t entry, Take&& take) {
  constexpr std::uint32_t kMostRuns = 18;  // 3 x 3 lines of cells along x, each in two runs if the buckets wrap around
  const GridEntry* const entries = grid.entries.data;
  const GridEntry& query = entries[entry];
  const InstanceBounds& bounds = grid.placements[entry].bounds;
  const bool several = grid.level_count > 1;
  const std::uint32_t own = several ? level_of(grid, bounds) : grid.levels[0];
  for (std::uint32_t l = 0; l < grid.level_count; ++l) {
    const std::uint32_t level = grid.levels[l];
    if (level < own) continue;
    CellRange cells = cells_to_search(grid, level, bounds);
    if (level == own && !grid.unused_axis[grid.order_axis]) ++cells.lo[grid.order_axis];
    std::uint32_t begin[kMostRuns], end[kMostRuns], runs = 0;
    for_each_run(grid, level, cells, [&](std::uint32_t run_begin, std::uint32_t run_end, std::int64_t, std::int64_t) {
      scan_entries(frame, query, run_begin, run_end, [&](std::uint32_t other) {
        if (level == own && !is_before(grid, entry, other)) return true;
        const InstanceBounds& others = grid.placements[other].bounds;
        if (several && level_of(grid, others) != level) return true;
        if (!frame.broad_phase.paired(query.batch, entries[other].batch) || !overlap(bounds, others)) return true;
        for (std::uint32_t i = 0; i < runs; ++i)
          if (other >= begin[i] && other < end[i]) return true;
        take(other);
        return true;
      });
      assert(runs < kMostRuns);
      begin[runs] = run_begin;
      end[runs++] = run_end;
      return true;
    });
  }
}

// Whether to search these cells one by one instead of scanning all entries: there are not many more cells than entries,
// and a line along x is short enough for for_each_run.
inline bool is_worth_searching(const Grid& grid, const CellRange& cells) {
  double count = 1;
  for (std::uint32_t c = 0; c < 3; ++c) count *= static_cast<double>(cells.hi[c] - cells.lo[c] + 1);
  return count <= 64 + static_cast<double>(grid.count) && cells.hi[0] - cells.lo[0] < std::int64_t{grid.mask};
}

// Whether the cells that `bounds` reach into are worth searching on every level.
inline bool is_worth_searching(const Grid& grid, const InstanceBounds& bounds) {
  for (std::uint32_t l = 0; l < grid.level_count; ++l)
    if (!is_worth_searching(grid, cells_to_search(grid, grid.levels[l], bounds))) return false;
  return true;
}

// Calls take(other) once for every entry of the kept grid whose instance still rests, whose bounds overlap those of an
// instance that is not in it, and whose batch a rule pairs with its batch.
template <class Take>
void for_each_kept(const FrameContext& frame, std::uint32_t batch, const InstanceBounds& bounds, Take&& take) {
  const Grid& grid = frame.broad_phase.kept;
  if (grid.count == 0) return;
  GridEntry query;
  set_entry(grid, bounds, batch, 0, query);
  const auto take_kept = [&](std::uint32_t other) {
    const GridEntry& entry = grid.entries[other];
    if (frame.broad_phase.paired(batch, entry.batch) && is_kept(frame, entry) &&
        overlap(bounds, grid.placements[other].bounds))
      take(other);
    return true;
  };
  if (!is_worth_searching(grid, bounds)) {
    scan_entries(frame, query, grid.first, grid.first + grid.count, take_kept);
    return;
  }
  for (std::uint32_t l = 0; l < grid.level_count; ++l) {
    const std::uint32_t level = grid.levels[l];
    const CellRange cells = cells_to_search(grid, level, bounds);
    for_each_run(grid, level, cells, [&](std::uint32_t first, std::uint32_t end, std::int64_t y, std::int64_t z) {
      return scan_entries(frame, query, first, end, [&](std::uint32_t other) {
        // Cells share buckets: an entry is taken where its own cell is searched.
        const InstanceBounds& others = grid.placements[other].bounds;
        if (level_of(grid, others) != level || cell_of(grid, level, 1, others.lo[1]) != y ||
            cell_of(grid, level, 2, others.lo[2]) != z)
          return true;
        const std::int64_t x = cell_of(grid, level, 0, others.lo[0]);
        return x < cells.lo[0] || x > cells.hi[0] || take_kept(other);
      });
    });
  }
}

}  // namespace cab
