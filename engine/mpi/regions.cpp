#include "engine/mpi/regions.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace cab::mpi {

std::int32_t size_class(const WorldBounds& bounds) {
  double most = 0;
  for (std::size_t c = 0; c < 3; ++c) most = std::max(most, bounds.hi[c] - bounds.lo[c]);
  constexpr std::int32_t kLeastExponent = -200;  // below any extent that matters, and even
  if (!(most > 0)) return kLeastExponent / 2;
  return (std::max(std::ilogb(most), kLeastExponent) - kLeastExponent) / 2 + kLeastExponent / 2;
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

RegionTable gather_regions(MPI_Comm comm, const std::vector<Region>& own) {
  Bytes bytes;
  append(bytes, own.data(), own.size());
  RegionTable table;
  const Bytes all = gather_all(comm, bytes, table.begins);
  table.regions.resize(all.size() / sizeof(Region));
  if (!all.empty()) std::memcpy(table.regions.data(), all.data(), all.size());
  for (std::size_t& begin : table.begins) begin /= sizeof(Region);
  return table;
}

Point middle_of(const Region& region) {
  Point out;
  for (std::size_t c = 0; c < 3; ++c) out.at[c] = region.bounds.lo[c] / 2 + region.bounds.hi[c] / 2;
  return out;
}

bool needs(const Partners& partners, std::int32_t to, const Region& there, std::int32_t from, const Region& here) {
  return tests({to, there.size}, {from, here.size}) && partners.has(there.batch, here.batch) &&
         meet(there.bounds, here.bounds);
}

}  // namespace cab::mpi
