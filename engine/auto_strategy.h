// What `auto` stands for, by what a frame holds and never by the clock: the same frame is always answered the same way.
#pragma once

#include "engine/engine.h"

namespace cab {

// The policies that a frame's characters are tested by, with a strategy that they can be tested by.
Policies resolve_characters(const Engine& engine, const FrameJob& job);

// Likewise for its sequences.
Policies resolve_sequences(const Engine& engine, const FrameJob& job);

}  // namespace cab
