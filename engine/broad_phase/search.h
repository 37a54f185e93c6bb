// Searches of the broad phase's grid.
#pragma once

#include "engine/candidate.h"
#include "engine/frame_context.h"

#include <cassert>

namespace cab {

inline bool overlap(const InstanceBounds& a, const InstanceBounds& b) {
  return (a.lo[0] <= b.hi[0]) & (b.lo[0] <= a.hi[0]) & (a.lo[1] <= b.hi[1]) & (b.lo[1] <= a.hi[1]) &
         (a.lo[2] <= b.hi[2]) & (b.lo[2] <= a.hi[2]);
}

// Entries that a kernel looks at in one call.
inline constexpr std::uint32_t kEntriesPerCall = 128;

// Calls take(entry) for each of the grid's entries from `first` to `end` - 1 that overlaps `query`; false when a call was.
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

// The cells of one level in which instances may begin that are looked for.
struct CellRange {
  std::int64_t lo[3], hi[3];
};

inline CellRange cells_to_search(const Grid& grid, std::uint32_t level, const InstanceBounds& bounds) {
  CellRange out;
  for (std::uint32_t c = 0; c < 3; ++c) {
    out.lo[c] = cell_of(grid, level, c, bounds.lo[c]) - (grid.unused_axis[c] ? 0 : 1);
    out.hi[c] = cell_of(grid, level, c, bounds.hi[c]);
  }
  return out;
}

// Calls scan(first, end) for the runs of entries that hold a range of cells, no longer along x than there are buckets. Cells
// share buckets: runs may overlap, and hold other entries too. False when a call was.
template <class Scan>
bool for_each_run(const Grid& grid, std::uint32_t level, const CellRange& cells, Scan&& scan) {
  const std::uint32_t length = static_cast<std::uint32_t>(cells.hi[0] - cells.lo[0] + 1);
  for (std::int64_t z = cells.lo[2]; z <= cells.hi[2]; ++z)
    for (std::int64_t y = cells.lo[1]; y <= cells.hi[1]; ++y) {
      const std::uint32_t first = bucket_of(grid, level, cells.lo[0], y, z);
      const std::uint32_t fits = std::min(length, grid.mask + 1 - first);
      if (!scan(grid.bucket[first], grid.bucket[first + fits])) return false;
      if (fits < length && !scan(0u, grid.bucket[length - fits])) return false;
    }
  return true;
}

// Whether the instance of entry x is the one of two on a level that finds the other: it begins lower along one axis, so in
// no later cell. Entries tell mostly, since rounding keeps the order of what it does not make equal or no number.
inline bool is_before(const Grid& grid, std::uint32_t x, std::uint32_t y) {
  const std::uint32_t axis = grid.order_axis;
  const GridEntry &entry_x = grid.entries[x], &entry_y = grid.entries[y];
  if (entry_x.side[axis] < entry_y.side[axis]) return true;
  if (entry_x.side[axis] > entry_y.side[axis]) return false;
  const double from = grid.placements[x].bounds.lo[axis], to = grid.placements[y].bounds.lo[axis];
  if (from != to) return from < to;
  return instance_key(entry_x.batch, entry_x.instance) < instance_key(entry_y.batch, entry_y.instance);
}

// Calls take(other) for the entries of the grid whose bounds overlap those of `entry`, with whose batch a rule pairs it, and that
// do not find `entry` themselves: each pair of entries is found once, by the one on the lower level or by the one that is
// before the other. No instance is larger than the cells of its own level and of higher ones, so it reaches into three
// of them at most along each axis.
template <class Take>
void for_each_later(const FrameContext& frame, std::uint32_t entry, Take&& take) {
  constexpr std::uint32_t kMostRuns = 18;  // 3 x 3 along y and z, each in two parts where the buckets end
  const Grid& grid = frame.broad_phase.grid;
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
    for_each_run(grid, level, cells, [&](std::uint32_t run_begin, std::uint32_t run_end) {
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

}  // namespace cab
