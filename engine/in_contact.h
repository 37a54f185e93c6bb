// Which instances touch anything: the caller's bytes, which the tasks of a frame only ever set.
#pragma once

#include "engine/candidate.h"
#include "engine/frame_context.h"

namespace cab {

// Whether nothing is to be learned about an instance: nobody asks, or it is known to touch.
inline bool is_already_reported(const InstanceBatch& batch, std::uint32_t instance) {
  const Span<std::uint8_t> in_contact = batch.input->in_contact;
  return in_contact.empty() || __atomic_load_n(&in_contact[instance], __ATOMIC_RELAXED);
}

inline bool is_already_reported(const FrameContext& frame, const Candidate& candidate) {
  return is_already_reported(frame.batch(candidate.batch_a), candidate.instance_a) &&
         is_already_reported(frame.batch(candidate.batch_b), candidate.instance_b);
}

// Notes that the two instances of a candidate touch.
inline void set_in_contact(const FrameContext& frame, const Candidate& candidate) {
  const auto set = [&frame](std::uint32_t batch, std::uint32_t instance) {
    const Span<std::uint8_t> in_contact = frame.batch(batch).input->in_contact;
    if (!in_contact.empty()) __atomic_store_n(&in_contact[instance], std::uint8_t{1}, __ATOMIC_RELAXED);
  };
  set(candidate.batch_a, candidate.instance_a);
  set(candidate.batch_b, candidate.instance_b);
}

}  // namespace cab
