// The description of bodies that are stored as arrays.
#pragma once

#include <cab/types.h>

namespace cab::scenes {

// Borrows link_parents, leaves and ignored_pairs of *storage; empty without storage.
template <class Storage>
ArticulationDesc desc_of(const Storage* storage) {
  ArticulationDesc desc;
  if (storage == nullptr) return desc;
  desc.link_parents = {storage->link_parents.data(), storage->link_parents.size()};
  desc.leaves = {storage->leaves.data(), storage->leaves.size()};
  desc.ignored_pairs = {storage->ignored_pairs.data(), storage->ignored_pairs.size()};
  return desc;
}

}  // namespace cab::scenes
