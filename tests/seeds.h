// Worlds by seeds 1 to n. CAB_TEST_SEED=N runs the world of that seed alone.
#pragma once

#include "perf/judge/oracle/random.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <cstdint>

namespace cab::tests {

// Tries a property on the worlds of seeds 1 to count, or on those that the environment chooses. Returns whether all of
// seeds 1 to count were tried, so that the caller can check totals.
template <class Property>
bool for_seeds(std::uint64_t count, Property&& property) {
  const std::uint64_t alone = number_from_environment("CAB_TEST_SEED", 0);
  const std::uint64_t first = alone ? alone : 1, last = alone ? alone : rounds(count);
  for (std::uint64_t seed = first; seed <= last; ++seed) {
    INFO("replay with CAB_TEST_SEED=", seed);
    oracle::Random random(seed);
    property(random);
  }
  return alone == 0 && last >= count;
}

// Whether the environment chooses no seed. Totals then follow from the number of rounds (least_count).
inline bool runs_all_seeds() { return number_from_environment("CAB_TEST_SEED", 0) == 0; }

}  // namespace cab::tests
