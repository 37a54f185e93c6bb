// Step 2 of a frame: the grid of the broad phase, which is built once per frame and then read by all workers.
#pragma once

#include "layout/grid_entry.h"
#include "layout/instance_batch.h"

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <cstring>
#include <limits>

namespace cab {

// Number of levels of the grid. Cells are 2^exponent[0] wide on the lowest level, and four times as wide on each level
// as on the one below. The last level holds all instances that are too large for the level below it, and its cells are
// wider if the largest instance needs it.
inline constexpr std::uint32_t kGridLevels = 16;

// Positions and extents of the instances, from which the cells are chosen. Each worker counts the instances that it
// bounds.
struct ExtentHistogram {
  static constexpr int kLeastExponent = -128, kMostExponent = 1024;
  static constexpr std::uint32_t kExponents = kMostExponent - kLeastExponent + 1;
  // The smallest and the largest lower bound of the instances along each axis.
  double lo[3] = {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity(),
                  std::numeric_limits<double>::infinity()};
  double hi[3] = {-lo[0], -lo[0], -lo[0]};
  std::uint32_t count = 0;
  // [axis][i]: how many instances have an extent in [2^(e - 1), 2^e), e = kLeastExponent + i. The first and the last
  // count also include all smaller and larger extents.
  std::uint32_t count_by_exponent[3][kExponents] = {};
};

// The entries of instances in a grid, grouped by bucket, and the cells they were grouped by. Grids share the arrays of
// entries and placements: each has the entries from `first` to first + count - 1.
struct Grid {
  Span<GridEntry> entries;     // grouped by bucket; one more than is used, since a kernel may read it
  Span<Placement> placements;  // placements[i] is of the instance of entries[i]
  Span<std::uint32_t> bucket;  // bucket b holds the entries bucket[b] to bucket[b + 1] - 1
  std::uint32_t first = 0;
  std::uint32_t mask = 0;                    // number of buckets, a power of two, less one
  std::uint32_t count = 0;                   // number of entries in use
  double origin[3] = {};                     // entries hold bounds relative to this point
  int exponent[kGridLevels] = {};            // by level: cells are 2^exponent wide
  double scale[kGridLevels] = {};            // by level: 2^-exponent
  std::atomic<bool> used[kGridLevels] = {};  // by level: whether it holds an instance
  std::uint32_t levels[kGridLevels] = {};    // the first level_count are the used levels, ascending
  std::uint32_t level_count = 0;
  bool alone = false;            // whether one worker builds it
  bool unused_axis[3] = {};      // by axis: whether all cells have index 0 along it, as the instances spread over few
  std::uint32_t order_axis = 0;  // a used axis, if there is one; orders the pairs within a level (is_before)
};

// How many entries the shared arrays have beyond one per instance: the kept grid may have that many whose instances no
// longer rest.
inline std::size_t spare_entries(std::size_t instances) { return instances / 16 + 64; }

// What searches read: the grids, and which batches the rules pair with each other.
struct BroadPhase {
  Grid grid;  // built in every frame
  // Of instances that rest, kept from frame to frame. An entry counts while its instance has kKept. It is built again
  // when more than spare_entries rest without being in it, or have left it.
  Grid kept;
  Span<std::uint64_t> paired_bits;   // bit a * batch_count + b: whether a rule pairs batches a and b
  Span<std::uint64_t> skipped_bits;  // the same: whether not those instances of which both rest
  std::size_t batch_count = 0;
  std::size_t instances = 0;     // most that the grids have room for together
  bool reports_resting = false;  // whether a rule reports the hits of two instances that both may rest
  bool keeps = false;            // whether the kept grid is built in this frame

  static bool has_bit(Span<std::uint64_t> bits, std::size_t bit) { return bits[bit >> 6] >> (bit & 63) & 1; }
  bool paired(std::uint32_t a, std::uint32_t b) const { return has_bit(paired_bits, a * batch_count + b); }
  bool skips_resting(std::uint32_t a, std::uint32_t b) const { return has_bit(skipped_bits, a * batch_count + b); }
};

// The smallest e with extent < 2^e, within the range of ExtentHistogram.
inline int exponent_above(double extent) {
  std::uint64_t bits;
  std::memcpy(&bits, &extent, sizeof bits);
  const int exponent = static_cast<int>(bits >> 52 & 0x7ff) - 1022;  // extents are never negative
  return std::clamp(exponent, ExtentHistogram::kLeastExponent, ExtentHistogram::kMostExponent);
}

// The lowest level whose cells are at least 2^exponent wide, or else the last level.
inline std::uint32_t level_of_exponent(const Grid& grid, int exponent) {
  const int above = exponent - grid.exponent[0];
  return above <= 0 ? 0 : std::min((static_cast<std::uint32_t>(above) + 1) / 2, kGridLevels - 1);
}

// The level of an instance: its cells are larger than the extent of the instance along every used axis.
inline std::uint32_t level_of(const Grid& grid, const InstanceBounds& bounds) {
  double extent = 0;
  for (std::uint32_t c = 0; c < 3; ++c)
    if (!grid.unused_axis[c]) extent = std::max(extent, bounds.hi[c] - bounds.lo[c]);
  return level_of_exponent(grid, exponent_above(extent));
}

// The index of the cell that holds the coordinate `at` along an axis. Widths are powers of two, so that scaling is
// exact.
inline std::int64_t cell_of(const Grid& grid, std::uint32_t level, std::uint32_t axis, double at) {
  if (grid.unused_axis[axis]) return 0;
  constexpr double most = std::int64_t{1} << 61;
  const double scaled = std::clamp(at * grid.scale[level], -most, most);
  const std::int64_t whole = static_cast<std::int64_t>(scaled);
  return whole - (static_cast<double>(whole) > scaled);
}

// The bucket of a cell. Neighbours along x have neighbouring buckets, and the last bucket is followed by the first.
inline std::uint32_t bucket_of(const Grid& grid, std::uint32_t level, std::int64_t x, std::int64_t y, std::int64_t z) {
  const std::uint64_t hash = static_cast<std::uint64_t>(x) + static_cast<std::uint64_t>(y) * 0x9e3779b97f4a7c15u +
                             static_cast<std::uint64_t>(z) * 0xc2b2ae3d27d4eb4fu +
                             std::uint64_t{level} * 0x165667b19e3779f9u;
  return static_cast<std::uint32_t>(hash) & grid.mask;
}

// The bucket of an instance: that of the cell which holds its lower bounds.
inline std::uint32_t bucket_of(const Grid& grid, const InstanceBounds& bounds, std::uint32_t level) {
  return bucket_of(grid, level, cell_of(grid, level, 0, bounds.lo[0]), cell_of(grid, level, 1, bounds.lo[1]),
                   cell_of(grid, level, 2, bounds.lo[2]));
}

// Fills the entry of an instance with its bounds relative to the grid's origin, rounded outwards to float. Entries may
// overlap by this rounding alone, so searches compare the bounds in double afterwards.
inline void set_entry(const Grid& grid, const InstanceBounds& bounds, std::uint32_t batch, std::uint32_t instance,
                      GridEntry& out) {
  for (std::uint32_t c = 0; c < 3; ++c) {
    out.side[c] = float_below(bounds.lo[c] - grid.origin[c]);
    out.side[3 + c] = float_below(grid.origin[c] - bounds.hi[c]);
  }
  out.batch = batch;
  out.instance = instance;
}

}  // namespace cab
