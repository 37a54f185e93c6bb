// Sizes the memory of the workers, and the memory that they share, for all batches of an engine.
#pragma once

#include "engine/session/engine.h"

namespace cab {

// A worker without memory yet. Throws std::bad_alloc.
WorkerPtr make_worker(const Allocator& allocator);

// Returns the number of instances in all character batches.
std::size_t character_count(const Engine& engine);

// If the memory of the workers, and what they share, does not suffice for every frame with the engine's batches, makes
// memory that does, and replaces the old one. If memory runs out, what is there stays. Throws std::bad_alloc.
void size_memory(Engine& engine);

// Makes a reader that is in use, while a read holds the engine. Throws std::bad_alloc.
Reader& add_reader(Engine& engine);

// The same as size_memory for batches that may be added.
void reserve_memory(const ReserveDesc& desc, Engine& engine);

}  // namespace cab
