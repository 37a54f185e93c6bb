// Hits of one exact test that another test does not have, and what the judge of convex shapes says about each.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "perf/base/engine_session.h"
#include "perf/measure/paper/gates.h"
#include "scenes/scene.h"

namespace cab::perf {

// Hits that are in only one of two lists.
struct HitDifference {
  std::vector<Touch> only_first, only_second;
};

// Both lists are sorted as EngineSession sorts them.
HitDifference difference_of(const std::vector<Touch>& first, const std::vector<Touch>& second);

// The frame and the two links of a hit, in words.
std::string describe(const scenes::Scene& scene, const Touch& touch);

// A hit by one of FCL and convex alone.
struct JudgedHit {
  Touch touch;
  bool by_convex;
  std::uint32_t leaf_a, leaf_b;  // of all leaves of the two links, those with the least gap
  double gap;                    // their distance, or less their depth, in the scene's units
  bool convex_is_right;          // by the promise of docs/proof.md, parts 8 and 9
  std::string text;              // all of it in words
};

// Judges every hit that only one of the two tests has, in order of the tests. Both lists are sorted as EngineSession
// sorts them.
std::vector<JudgedHit> judge_differences(const scenes::Scene& scene, const std::vector<Touch>& by_fcl,
                                         const std::vector<Touch>& by_convex);

// The gate that hits by convex are those by FCL, but for hits in which the judge agrees with convex. Its text names
// each hit that differs. hits: by convex.
Gate convex_gate(std::uint64_t hits, const std::vector<JudgedHit>& differences);

}  // namespace cab::perf
