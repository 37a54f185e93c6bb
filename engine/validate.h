// What a call's inputs must be, checked before any output is touched.
#pragma once

#include "engine/call.h"

namespace cab {

// True when poses of so many links have data, a known format, and strides that are wide enough.
bool valid_poses(const PoseView& poses, std::size_t link_count);

// Checks one batch's poses against the batch.
Status validate_input(const Engine& engine, const BatchInput& input);

// Checks every input and binds its batch to it for the duration of the call.
Status bind_inputs(Engine& engine, Call& call, Span<const BatchInput> inputs);

Status validate_policies(const Policies& policies);

// Checks the rest of a job whose inputs are bound.
Status validate_job(Engine& engine, const FrameJob& job);

}  // namespace cab
