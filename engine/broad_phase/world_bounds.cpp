#include "engine/broad_phase/world_bounds.h"

#include "layout/error_bounds.h"

#include <algorithm>
#include <cmath>

namespace cab {

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
                     const AabbTile* leaves) {
  AabbTile all;
  kernels.bound_together(leaves, posed_articulation(*batch.active).leaf_count, &all);
  for (std::uint32_t lane = 0; lane < instances.count; ++lane)
    batch.bounds[instances.instance[lane]] = world_bounds(batch, instances.instance[lane], all, lane);
}

void bound_few_instances(const kernel::KernelTable& kernels, InstanceBatch& batch, const TileInstances& instances,
                         const AabbTile* leaves) {
  const std::uint32_t tiles = tile_count(batch.active->leaf_count);
  for (std::uint32_t i = 0; i < instances.count; ++i) {
    AabbTile all;
    kernels.bound_together(leaves + i * tiles, tiles, &all);
    for (std::uint32_t c = 0; c < 3; ++c) {
      all.lo[c][0] = *std::min_element(all.lo[c], all.lo[c] + kLanes);
      all.hi[c][0] = *std::max_element(all.hi[c], all.hi[c] + kLanes);
    }
    batch.bounds[instances.instance[i]] = world_bounds(batch, instances.instance[i], all, 0);
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

}  // namespace cab
