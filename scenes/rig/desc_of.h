// The description of bodies that are stored as arrays.
#pragma once

#include <cab/types.h>

namespace cab::scenes {

// Borrows link_parents, leaves and ignored_pairs of *storage; empty without storage.
template <class Storage>
ArticulationDesc desc_of(const Storage* storage) {
  ArticulationDesc desc;
  if (storage == nullptr) return desc;
  desc.link_parents = storage->link_parents;
  desc.leaves = storage->leaves;
  desc.ignored_pairs = storage->ignored_pairs;
  return desc;
}

}  // namespace cab::scenes
