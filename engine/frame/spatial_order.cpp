// The order of a batch's characters in which neighbours are near each other.
#include "engine/broad_phase/z_order.h"
#include "engine/session/call.h"
#include "kernels/float_mode.h"

#include <algorithm>
#include <exception>
#include <limits>
#include <vector>

namespace cab {
namespace {

// A cube about all live characters is cut into 2^21 cells along each axis, so that the number of a cell has 63 bits.
constexpr int kBitsPerAxis = 21;
constexpr std::uint64_t kLastKey = std::numeric_limits<std::uint64_t>::max();  // of masked characters

bool is_live(const InstanceBatch& batch, std::uint32_t instance) {
  return batch.live[instance / kLanes] >> (instance % kLanes) & 1;
}

// A cube that holds the lower bounds of the live characters. Lengths are halved, since their differences could
// overflow.
struct Cube {
  double half_lo[3];
  double half_width = 0;

  // Half of a bound, which may be infinite about a finite place.
  static double half(double bound) {
    constexpr double kMost = std::numeric_limits<double>::max();
    return 0.5 * std::clamp(bound, -kMost, kMost);
  }

  explicit Cube(const InstanceBatch& batch) {
    double hi[3];
    for (int c = 0; c < 3; ++c) half_lo[c] = std::numeric_limits<double>::infinity(), hi[c] = -half_lo[c];
    for (std::uint32_t i = 0; i < batch.instance_count; ++i)
      if (is_live(batch, i))
        for (int c = 0; c < 3; ++c) {
          half_lo[c] = std::min(half_lo[c], half(batch.bounds[i].lo[c]));
          hi[c] = std::max(hi[c], half(batch.bounds[i].lo[c]));
        }
    for (int c = 0; c < 3; ++c) half_width = std::max(half_width, hi[c] - half_lo[c]);
  }

  // The number of the cell of a point along a Z-order curve.
  std::uint64_t key_of(const double (&point)[3]) const {
    if (half_width == 0) return 0;
    std::uint64_t key = 0;
    for (int c = 0; c < 3; ++c) {
      constexpr double kCells = std::uint64_t{1} << kBitsPerAxis;
      const double at = (half(point[c]) - half_lo[c]) / half_width * kCells;
      key |= spread_bits(static_cast<std::uint64_t>(std::min(at, kCells - 1))) << c;
    }
    return key;
  }
};

struct Keyed {
  std::uint64_t key;
  std::uint32_t instance;
};

}  // namespace

Status spatial_order(Engine& engine, BatchId id, Span<std::uint32_t> order) noexcept try {
  Call call(engine, Access::kReadsOnOneThread);
  if (!call.admitted()) return Status::kBusy;
  const kernel::FloatMode mode;
  if (!has_batch(engine, id)) return Status::kUnknownBatch;
  call.store_last_bounds(slot_of(id).value - 1);
  const InstanceBatch& batch = engine.batch(id);
  if (order.size < batch.instance_count || !order.data) return Status::kBadOutput;
  std::vector<Keyed> keyed(batch.instance_count);
  for (std::uint32_t i = 0; i < batch.instance_count; ++i) keyed[i] = {kLastKey, i};
  if (batch.kind == BatchKind::kCharacters) {
    const Cube cube(batch);
    for (Keyed& one : keyed)
      if (is_live(batch, one.instance)) one.key = cube.key_of(batch.bounds[one.instance].lo);
  }
  std::sort(keyed.begin(), keyed.end(),
            [](const Keyed& a, const Keyed& b) { return a.key != b.key ? a.key < b.key : a.instance < b.instance; });
  for (std::uint32_t i = 0; i < batch.instance_count; ++i) order.data[i] = keyed[i].instance;
  return Status::kOk;
} catch (const std::exception&) { return Status::kOutOfMemory; }

}  // namespace cab
