// Which instances of a batch of characters take part in a call.
#pragma once

#include "engine/step/candidate.h"
#include "engine/step/instance_batch.h"
#include "layout/atomic_words.h"
#include "layout/compiler.h"

#include <algorithm>

namespace cab {

// Takes an instance for masked. Tasks of listed instances share words.
inline void clear_live(std::uint32_t instance, InstanceBatch& batch) {
  const auto others = static_cast<std::uint16_t>(~(1u << instance % kLanes));
  std::uint16_t& word = batch.live[instance / kLanes];
  if (batch.input->instances.empty())
    word = static_cast<std::uint16_t>(word & others);
  else
    relaxed_and(word, others);
}

// The same for the instances that are not given in this call, where others may rest: their live bits are those of the
// last frame.
inline void clear_inactive_at_rest(InstanceBatch& batch) {
  const Span<const std::uint32_t> listed = batch.input->instances;
  const std::uint32_t* next = listed.begin();
  for (std::uint32_t i = listed.empty() ? batch.instance_count : 0; i < batch.capacity; ++i) {
    if (next != listed.end() && *next == i) {
      ++next;
      continue;
    }
    clear_live(i, batch);
    batch.rest[i] = 0;
    batch.hit_chains[i] = {};
  }
}

// Takes the instances that are not given in this call for masked, and empties their chains of hits.
inline void clear_inactive(InstanceBatch& batch) {
  if (batch.may_rest) return clear_inactive_at_rest(batch);
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
    const std::uint32_t instance = instances.instance[lowest_bit(live)];
    relaxed_or(batch.live[instance / kLanes], static_cast<std::uint16_t>(1u << instance % kLanes));
  }
}

// Whether an instance that is given in this frame rests. It must have been in its batch's last frame, unmasked: so the
// flags of a masked instance are found again in every frame. Asked before anything is posed.
inline bool still_resting(const InstanceBatch& batch, std::uint32_t instance) {
  return batch.may_rest && !batch.input->moved[instance] && (batch.live[instance / kLanes] >> instance % kLanes & 1);
}

}  // namespace cab
