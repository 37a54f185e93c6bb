// The slots of an engine: where its articulations and batches are kept.
#pragma once

#include "engine/session/engine.h"

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

namespace cab {

// The lowest slot that is not in use, or a new one. A slot that a failed call leaves behind is taken by the next.
template <class StoredPtr>
std::size_t free_slot(const Allocator& allocator, std::vector<StoredPtr>& slots) {
  const auto free = std::find_if(slots.begin(), slots.end(), [](const auto& slot) { return !slot->in_use(); });
  const auto index = static_cast<std::size_t>(free - slots.begin());
  if (free == slots.end()) slots.push_back(StoredPtr(new typename StoredPtr::element_type(allocator)));
  return index;
}

// The next serial number of an id, from 1 on. Engines share the numbers, so that an id is of one engine only.
std::uint32_t next_serial();

// Puts what was made in place of what a slot holds, under an id of its own.
template <class StoredPtr>
void fill_slot(StoredPtr made, StoredPtr& slot) {
  made->serial = next_serial();
  slot = std::move(made);
}

const StoredArticulation* find_stored(const Engine& engine, ArticulationId id);

// The articulation that an id names; null if it names none.
const Articulation* find_articulation(const Engine& engine, ArticulationId id);

// Makes all that is derived from a built articulation, and puts it into a slot of the engine. Throws std::bad_alloc.
void store_articulation(std::unique_ptr<StoredArticulation> made, Engine& engine, ArticulationId* out);

}  // namespace cab
