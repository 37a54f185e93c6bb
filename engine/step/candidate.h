// A candidate: two instances that may touch, or one instance whose links may touch each other.
#pragma once

#include "layout/tile.h"

#include <cstdint>

namespace cab {

// The two instances to test. The key of a is lower than the key of b, or both are one instance. Batches are given by
// index (BatchId::value - 1).
struct Candidate {
  std::uint32_t batch_a, instance_a;
  std::uint32_t batch_b, instance_b;
  std::uint32_t slot_a = 0, slot_b = 0;  // characters: slots of their boxes in the worker's PosedSet
};

// A candidate that waits: the sorted rows of its two instances.
struct RowPair {
  std::uint32_t a, b;
};

// Whether the candidate tests the links of one instance against each other.
inline bool is_within(const Candidate& candidate) {
  return candidate.batch_a == candidate.batch_b && candidate.instance_a == candidate.instance_b;
}

// The key of an instance: it orders instances by the index of their batch, then by their index in it. Hits are sorted
// by the keys of their two instances first.
inline std::uint64_t instance_key(std::uint32_t batch, std::uint32_t instance) {
  return std::uint64_t{batch} << 32 | instance;
}

// Up to sixteen instances of one batch that are posed as one tile. Lane i is instance[i] if i < count.
struct TileInstances {
  std::uint32_t instance[kLanes];
  std::uint32_t count;
};

}  // namespace cab
