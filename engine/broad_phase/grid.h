// The grid of the broad phase: what a frame builds and every worker reads.
#pragma once

#include "layout/grid_entry.h"
#include "layout/instance_batch.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

namespace cab {

// Cells are 2^exponent wide on the lowest level and four times as wide on each level above; what is larger than the
// cells of the last level but one is on the last, whose cells are as large as it needs.
inline constexpr std::uint32_t kGridLevels = 16;

// What is known of the instances before cells are chosen.
struct ExtentHistogram {
  static constexpr int kLeastExponent = -128, kMostExponent = 1024;
  static constexpr std::uint32_t kExponents = kMostExponent - kLeastExponent + 1;
  double lo[3] = {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity(),
                  std::numeric_limits<double>::infinity()};
  double hi[3] = {-lo[0], -lo[0], -lo[0]};  // of where their bounds begin
  std::uint32_t count = 0;
  // By axis: instances whose extent is below 2^(kLeastExponent + index), and not below half of it.
  std::uint32_t count_by_exponent[3][kExponents] = {};
};

struct Grid {
  Span<GridEntry> entries;     // grouped by bucket, and one more
  Span<Placement> placements;  // of each entry's instance
  Span<std::uint32_t> bucket;  // a power of two and one: where each bucket's entries begin
  std::uint32_t mask = 0;      // bucket count less one
  std::uint32_t count = 0;     // entries in use
  double origin[3] = {};       // of the entries' bounds
  int exponent[kGridLevels] = {};
  double scale[kGridLevels] = {};  // 2^-exponent
  std::atomic<bool> used[kGridLevels] = {};
  std::uint32_t levels[kGridLevels] = {};  // that are used, ascending
  std::uint32_t level_count = 0;
  bool unused_axis[3] = {};      // axes along which the instances spread too little to be told apart by cells
  std::uint32_t order_axis = 0;  // one that is used, if any is: along it pairs of one level are ordered
};

// What searches read: the grid, and which batches some rule tests against each other.
struct BroadPhase {
  Grid grid;
  Span<std::uint64_t> paired_bits;  // bit a * batch_count + b
  std::size_t batch_count = 0;

  bool paired(std::uint32_t a, std::uint32_t b) const {
    const std::size_t bit = a * batch_count + b;
    return paired_bits[bit >> 6] >> (bit & 63) & 1;
  }
};

// The least e such that every value up to `extent` is below 2^e.
inline int exponent_above(double extent) {
  std::uint64_t bits;
  std::memcpy(&bits, &extent, sizeof bits);
  const int exponent = static_cast<int>(bits >> 52 & 0x7ff) - 1022;  // extents are never negative
  return std::clamp(exponent, ExtentHistogram::kLeastExponent, ExtentHistogram::kMostExponent);
}

inline std::uint32_t level_of_exponent(const Grid& grid, int exponent) {
  const int above = exponent - grid.exponent[0];
  return above <= 0 ? 0 : std::min((static_cast<std::uint32_t>(above) + 1) / 2, kGridLevels - 1);
}

inline std::uint32_t level_of(const Grid& grid, const InstanceBounds& bounds) {
  double extent = 0;
  for (std::uint32_t c = 0; c < 3; ++c)
    if (!grid.unused_axis[c]) extent = std::max(extent, bounds.hi[c] - bounds.lo[c]);
  return level_of_exponent(grid, exponent_above(extent));
}

// The number of the cell that holds a coordinate. Cells are powers of two, so nothing is rounded but to below.
inline std::int64_t cell_of(const Grid& grid, std::uint32_t level, std::uint32_t axis, double at) {
  if (grid.unused_axis[axis]) return 0;
  constexpr double most = std::int64_t{1} << 61;
  const double scaled = std::clamp(at * grid.scale[level], -most, most);
  const std::int64_t whole = static_cast<std::int64_t>(scaled);
  return whole - (static_cast<double>(whole) > scaled);
}

// Cells that follow each other along x have buckets that follow each other.
inline std::uint32_t bucket_of(const Grid& grid, std::uint32_t level, std::int64_t x, std::int64_t y, std::int64_t z) {
  const std::uint64_t hash = static_cast<std::uint64_t>(x) + static_cast<std::uint64_t>(y) * 0x9e3779b97f4a7c15u +
                             static_cast<std::uint64_t>(z) * 0xc2b2ae3d27d4eb4fu +
                             std::uint64_t{level} * 0x165667b19e3779f9u;
  return static_cast<std::uint32_t>(hash) & grid.mask;
}

inline std::uint32_t bucket_of(const Grid& grid, const InstanceBounds& bounds, std::uint32_t level) {
  return bucket_of(grid, level, cell_of(grid, level, 0, bounds.lo[0]), cell_of(grid, level, 1, bounds.lo[1]),
                   cell_of(grid, level, 2, bounds.lo[2]));
}

// Makes an entry: bounds about the grid's origin. What float rounds only lets more entries overlap, which their bounds in double
// tell apart.
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
