// `cab sweep --lods`: what coarser levels of detail cost, and how many more characters they report.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "perf/base/statistics.h"
#include "perf/measure/sweep/scenes.h"

namespace cab::perf {

// All characters of a crowd at one level. Counts are of all frames, once.
struct LodRow {
  std::string name;
  Spread seconds;                 // of a frame
  std::uint64_t candidates = 0;   // pairs of characters whose bounds overlap
  std::uint64_t hits = 0;         // pairs of leaves
  std::uint64_t pairs = 0;        // of characters that are reported
  std::uint64_t false_pairs = 0;  // those that are apart by the exact test convex of the finest level
  std::uint64_t misses = 0;       // pairs of characters that touch by that test and are not reported
};

// The finest level, and levels of both kinds with 1, 2, 4 ... leaves, up to the links of the smallest figure.
std::vector<LodRow> sweep_lods(const SweepScene& scene, std::uint32_t rounds);

void print_lods(const SweepScene& scene, const std::vector<LodRow>& rows);

}  // namespace cab::perf
