// Which instances touch anything: the caller's bytes, which the tasks of a frame only ever set.
#pragma once

#include "engine/engine.h"

namespace cab {

// Whether nothing is to be learned about an instance: nobody asks, or it is known to touch.
inline bool is_settled(const InstanceBatch& batch, std::uint32_t instance) {
  const Span<std::uint8_t> touched = batch.input->touched;
  return touched.empty() || __atomic_load_n(&touched[instance], __ATOMIC_RELAXED);
}

inline bool is_settled(const Engine& engine, const Candidate& candidate) {
  return is_settled(engine.batches[candidate.batch_a]->batch, candidate.instance_a) &&
         is_settled(engine.batches[candidate.batch_b]->batch, candidate.instance_b);
}

// Notes that the two instances of a candidate touch.
inline void set_touched(const Engine& engine, const Candidate& candidate) {
  const auto set = [&engine](std::uint32_t batch, std::uint32_t instance) {
    const Span<std::uint8_t> touched = engine.batches[batch]->batch.input->touched;
    if (!touched.empty()) __atomic_store_n(&touched[instance], std::uint8_t{1}, __ATOMIC_RELAXED);
  };
  set(candidate.batch_a, candidate.instance_a);
  set(candidate.batch_b, candidate.instance_b);
}

}  // namespace cab
