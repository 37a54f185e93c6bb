// Which instances of a batch of characters take part in a call.
#pragma once

#include "engine/candidate.h"
#include "layout/instance_batch.h"

#include <algorithm>

namespace cab {

// Takes the instances that are not given in this call for masked, and empties their chains of hits.
inline void clear_not_given(InstanceBatch& batch) {
  const std::uint32_t first = batch.input->instances.empty() ? tile_count(batch.instance_count) : 0;
  for (std::uint32_t tile = first; tile < tile_count(batch.capacity); ++tile) batch.live[tile] = 0;
  if (first == 0) std::fill(batch.hit_chains.begin(), batch.hit_chains.end(), HitChain{});
}

// Records which instances of a tile are live. The bits of tiles that are not consecutive instances are clear before,
// and tasks may share their words.
inline void set_live(const TileInstances& instances, std::uint32_t live, InstanceBatch& batch) {
  if (batch.input->instances.empty() && !batch.may_rest) {
    batch.live[instances.instance[0] / kLanes] = static_cast<std::uint16_t>(live);
    return;
  }
  for (; live; live &= live - 1) {
    const std::uint32_t instance = instances.instance[__builtin_ctz(live)];
    __atomic_fetch_or(&batch.live[instance / kLanes], static_cast<std::uint16_t>(1u << instance % kLanes),
                      __ATOMIC_RELAXED);
  }
}

}  // namespace cab
