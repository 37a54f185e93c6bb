// What `auto` stands for, by what a frame holds and never by the clock: the same frame is always answered the same way.
#pragma once

#include "engine/engine.h"

namespace cab {

// The policies by which a frame's characters are tested: `auto` resolved, and a strategy that they can be tested by.
Policies resolve_characters(const Engine& engine, const FrameJob& job);

// The same for a frame's sequences.
Policies resolve_sequences(const Engine& engine, const FrameJob& job);

// Whether a frame of characters is over before other threads would begin, by policies without `auto`.
bool is_small(const Engine& engine, const FrameJob& job, const Policies& policies);

}  // namespace cab
