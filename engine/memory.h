// How much memory an engine's batches ask for.
#pragma once

#include "engine/engine.h"

namespace cab {

// Instances of all character batches.
std::size_t character_count(const Engine& engine);

// Sizes fresh workers and shared lists for all batches, then replaces the old ones: nothing changes if memory fails.
// Throws std::bad_alloc.
void size_memory(Engine& engine);

}  // namespace cab
