#include "engine/mpi/regions.h"

#include "engine/mpi/agreement.h"
#include "engine/mpi/out_of_memory.h"

#include <algorithm>
#include <cmath>

namespace cab::mpi {

std::int32_t size_class(const WorldBounds& bounds) {
  double most = 0;
  for (std::size_t c = 0; c < 3; ++c) most = std::max(most, bounds.hi[c] - bounds.lo[c]);
  constexpr std::int32_t kLeastExponent = -200;  // below any extent that matters, and even
  constexpr std::int32_t kMostExponent = 1024;   // of bounds beyond a double
  if (!(most > 0)) return kLeastExponent / 2;
  return (std::clamp(std::ilogb(most), kLeastExponent, kMostExponent) - kLeastExponent) / 2 + kLeastExponent / 2;
}

bool tests(const Owner& a, const Owner& b) {
  if (a.size != b.size) return a.size < b.size;
  return ((a.rank + b.rank) % 2 == 1) == (a.rank < b.rank);
}

std::uint32_t members_of(const BatchInput& input) {
  std::uint32_t out = static_cast<std::uint32_t>(input.poses.format) << 8;
  if (!input.origins.empty()) out |= kHasOrigins;
  if (!input.orientations.empty()) out |= kHasOrientations;
  if (!input.layers.empty()) out |= kHasLayers;
  if (!input.layer_masks.empty()) out |= kHasMasks;
  if (!input.scales.empty()) out |= kHasScales;
  if (!input.margins.empty()) out |= kHasMargins;
  if (input.poses.has_scale) out |= kHasPoseScale;
  return out;
}

PoseFormat format_of(std::uint32_t members) { return static_cast<PoseFormat>(members >> 8); }

Answer gather_regions(MPI_Comm comm, Status status, const std::vector<Region>& own, RegionTable& table) noexcept {
  // A rank that failed has no regions. It tells its status, below 0, instead of their size.
  const int size = status == Status::kOk ? static_cast<int>(own.size() * sizeof(Region)) : -static_cast<int>(status);
  MPI_Allgather(&size, 1, MPI_INT, table.sizes.data(), 1, MPI_INT, comm);
  int sum = 0;
  for (std::size_t r = 0; r < table.sizes.size(); ++r) {
    if (table.sizes[r] < 0) return {static_cast<Status>(-table.sizes[r]), Difference::kNone, static_cast<int>(r)};
    table.offsets[r] = sum;
    table.begins[r] = static_cast<std::size_t>(sum) / sizeof(Region);
    sum += table.sizes[r];
  }
  const std::size_t count = static_cast<std::size_t>(sum) / sizeof(Region);
  table.begins.back() = count;
  // All ranks know the count, so all know whether there must be more room than ever before.
  if (count > table.room) {
    const Status grown = or_out_of_memory([&] { table.regions.resize(count); });
    if (const Answer answer = agree(comm, grown, 0, Difference::kNone); !answer.ok()) return answer;
    table.room = count;
  }
  table.regions.resize(count);
  MPI_Allgatherv(own.data(), size, MPI_BYTE, table.regions.data(), table.sizes.data(), table.offsets.data(), MPI_BYTE,
                 comm);
  return {};
}

std::optional<Point> middle_of(const Region& region) {
  constexpr double kMostWidth = double{kMaxCoordinate};
  Point out;
  for (std::size_t c = 0; c < 3; ++c) {
    if (!(region.bounds.hi[c] - region.bounds.lo[c] <= kMostWidth)) return std::nullopt;
    out.at[c] = region.bounds.lo[c] / 2 + region.bounds.hi[c] / 2;
  }
  return out;
}

bool needs(const Partners& partners, std::int32_t to, const Region& there, std::int32_t from, const Region& here) {
  return tests({to, there.size}, {from, here.size}) && partners.has(there.batch, here.batch) &&
         meet(there.bounds, here.bounds);
}

}  // namespace cab::mpi
