// What a call's inputs must be, checked before any output is touched.
#pragma once

#include "engine/frame.h"

namespace cab {

// Checks one batch's poses against the batch.
Status validate_input(const Engine& engine, const BatchInput& input);

// Checks every input and binds its batch to it for the duration of the call.
Status bind_inputs(Engine& engine, Call& call, Span<const BatchInput> inputs);

Status validate_policies(const Policies& policies);

// Checks the rest of a job whose inputs are bound.
Status validate_job(Engine& engine, const FrameJob& job);

}  // namespace cab
