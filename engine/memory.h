// Sizes the memory of the workers, and the memory that they share, for all batches of an engine.
#pragma once

#include "engine/engine.h"

namespace cab {

// Returns the number of instances in all character batches.
std::size_t character_count(const Engine& engine);

// Makes new workers and shared arrays that suffice for every frame with the engine's batches, then replaces the old
// ones. Changes nothing if memory runs out. Throws std::bad_alloc.
void size_memory(Engine& engine);

}  // namespace cab
