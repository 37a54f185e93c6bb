// The checks of a call's arguments, before the call writes any output.
#pragma once

#include "engine/session/call.h"

namespace cab {

// What a call needs to know of every instance from its caller.
enum class Needs : std::uint8_t {
  kNothing,
  kPoses,
  kPosesOfFrame,  // poses, of which the caller says that they are those of the last frame: values are not checked again
  kBounds
};

// Checks one input against its batch: the id, what the call needs, and the size of every array.
Status validate_input(const Engine& engine, const BatchInput& input, Needs needs);

// Checks an input and binds its batch to it for the rest of the call. Refuses a batch that has an input already.
Status bind_input(Engine& engine, Call& call, const BatchInput& input, Needs needs);

// The same for every input.
Status bind_inputs(Engine& engine, Call& call, Span<const BatchInput> inputs, Needs needs = Needs::kPoses);

// Whether a rule names batches that are bound to an input, and pairs them as their kinds allow.
bool is_valid_rule(const Engine& engine, const PairRule& rule);

// Checks that every policy has a value of its enumeration.
Status validate_policies(const Policies& policies);

// Checks that the pairs of compute_contacts name links of batches that are bound to an input.
Status validate_pairs(const Engine& engine, const Call& call, Span<const Hit> pairs);

// Whether the results of a job depend on contacts.
bool needs_contacts(const FrameJob& job);

// Checks the rules, policies and output arrays of a job whose inputs are bound. Writes only engine.rule_bits.
Status validate_job(Engine& engine, const FrameJob& job);

}  // namespace cab
