// The grid of the broad phase: what a frame builds and every worker reads.
#pragma once

#include "layout/bounds_row.h"
#include "layout/instance_batch.h"

#include <atomic>
#include <cstdint>
#include <limits>

namespace cab {

// Cells are 2^exponent wide on the lowest level and four times as wide on each level above; what is larger than the
// cells of the last level but one is on the last, whose cells are as large as it needs.
inline constexpr std::uint32_t kGridLevels = 16;

// What is known of the instances before cells are chosen.
struct GridSurvey {
  static constexpr int kLeastExponent = -128, kMostExponent = 1024;
  static constexpr std::uint32_t kExponents = kMostExponent - kLeastExponent + 1;
  double lo[3] = {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity(),
                  std::numeric_limits<double>::infinity()};
  double hi[3] = {-lo[0], -lo[0], -lo[0]};  // of where their bounds begin
  std::uint32_t count = 0;
  // By axis: instances whose extent is below 2^(kLeastExponent + index), and not below half of it.
  std::uint32_t of_exponent[3][kExponents] = {};
};

struct Grid {
  Span<BoundsRow> rows;        // grouped by bucket, and one more
  Span<Placement> placements;  // of each row's instance
  Span<std::uint32_t> bucket;  // a power of two and one: where each bucket's rows begin
  std::uint32_t mask = 0;      // bucket count less one
  std::uint32_t count = 0;     // rows in use
  double origin[3] = {};       // of the rows' bounds
  int exponent[kGridLevels] = {};
  double scale[kGridLevels] = {};  // 2^-exponent
  std::atomic<bool> used[kGridLevels] = {};
  bool flat[3] = {};  // axes along which the instances spread too little to be told apart by cells
};

}  // namespace cab
