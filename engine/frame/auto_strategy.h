// Resolves the strategy `auto` before the first step of a frame.
// Only the job, its articulations and its batches decide, never a clock, so that equal frames get equal strategies.
#pragma once

#include "engine/session/engine.h"

namespace cab {

// Sets the strategy of every batch of characters. `auto` becomes `tree`, `links` or `rows`, by the articulation of the
// batch. `links` becomes `rows` if no link of the batch has several leaves or if the refit is axis-aligned.
// Returns the job's policies with the strategy of all these batches, or with `auto` if they differ.
Policies resolve_characters(Engine& engine, const FrameJob& job);

// Returns the job's policies with the strategy for its sequences. `auto` becomes `tree` or `brute`, and `links` becomes
// `tree`.
Policies resolve_sequences(const Engine& engine, const FrameJob& job);

// Whether the calling thread finishes the frame before other threads start: few characters, no sequences, strategy
// `rows` and no exact test. `policies` are those that resolve_characters returns.
bool runs_on_one_thread(const Engine& engine, const FrameJob& job, const Policies& policies);

}  // namespace cab
