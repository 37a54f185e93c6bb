// BatchInput::in_contact: one byte per instance, which the tasks of a frame read and set at the same time. A byte that
// is set stays set until the frame ends.
#pragma once

#include "engine/step/candidate.h"
#include "engine/step/frame_context.h"
#include "layout/atomic_words.h"

#include <algorithm>

namespace cab {

// Whether no test of the instance can change what is reported about it: its byte is set, or the caller gave no bytes.
inline bool is_already_reported(const InstanceBatch& batch, std::uint32_t instance) {
  const Span<std::uint8_t> in_contact = batch.input->in_contact;
  return in_contact.empty() || relaxed_load(in_contact[instance]);
}

// Whether this holds for both instances of a candidate.
inline bool is_already_reported(const FrameContext& frame, const Candidate& candidate) {
  return is_already_reported(frame.batch(candidate.batch_a), candidate.instance_a) &&
         is_already_reported(frame.batch(candidate.batch_b), candidate.instance_b);
}

// Sets the byte of an instance. batch: its number.
inline void set_in_contact(const FrameContext& frame, std::uint32_t batch, std::uint32_t instance) {
  const Span<std::uint8_t> in_contact = frame.batch(batch).input->in_contact;
  if (!in_contact.empty()) relaxed_store(in_contact[instance], 1);
}

// Sets the bytes of both instances of a candidate.
inline void set_in_contact(const FrameContext& frame, const Candidate& candidate) {
  set_in_contact(frame, candidate.batch_a, candidate.instance_a);
  set_in_contact(frame, candidate.batch_b, candidate.instance_b);
}

// Clears all bytes.
inline void clear_in_contact(Span<const BatchInput> inputs) {
  for (const BatchInput& input : inputs) std::fill(input.in_contact.begin(), input.in_contact.end(), std::uint8_t{0});
}

}  // namespace cab
