// A candidate: two instances, or one and itself, that may touch.
#pragma once

#include "layout/tile.h"

#include <cstdint>

namespace cab {

// Two instances to be tested: (batch, instance) of a is lower than that of b, or both are the same instance.
struct Candidate {
  std::uint32_t batch_a, instance_a;
  std::uint32_t batch_b, instance_b;
  std::uint32_t slot_a = 0, slot_b = 0;  // of their boxes in the worker's PosedSet (engine/posed_set.h)
};

inline bool is_within(const Candidate& candidate) {
  return candidate.batch_a == candidate.batch_b && candidate.instance_a == candidate.instance_b;
}

// The key of an instance. Hits are sorted by the keys of their two instances first.
inline std::uint64_t instance_key(std::uint32_t batch, std::uint32_t instance) {
  return std::uint64_t{batch} << 32 | instance;
}

// Instances of one batch that are posed together.
struct TileInstances {
  std::uint32_t instance[kLanes];
  std::uint32_t count;
};

}  // namespace cab
