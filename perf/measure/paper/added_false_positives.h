// How many leaf pairs the padding of leaf boxes and the slack of the overlap test add to those whose boxes touch.
#pragma once

#include <cab/types.h>

#include <cstdint>
#include <string>
#include <vector>

#include "perf/measure/paper/gates.h"
#include "scenes/scene.h"

namespace cab::perf {

// Pairs of links whose leaf boxes overlap, summed over all frames of a scene. The judge
// (perf/judge/oracle/exact_pose.h) works in long double, without padding or slack, on the boxes and poses as the scene
// describes them.
struct AddedFalsePositives {
  std::uint64_t found = 0;       // by the engine: the tables' #coll where a link has one leaf
  std::uint64_t touching = 0;    // by the judge
  std::uint64_t by_padding = 0;  // found; the judge calls the boxes apart, but touching with the engine's padding
  std::uint64_t by_slack = 0;    // found; the judge calls the boxes apart, also with the engine's padding
  std::uint64_t missed = 0;      // touching, and not found

  // The added pairs in per cent of the touching pairs; 0 if no pair touches.
  double percent() const;
};

// Runs the scene's pairs of characters with CAB boxes and judges every pair of their links in every frame.
AddedFalsePositives count_added_false_positives(const scenes::Scene& scene, Isa isa);

// The largest percentage that padding and slack may add on a full run.
inline constexpr double kAddedPercentLimit = 0.1;

// The counts as one line of text.
std::string describe(const AddedFalsePositives& added);

// The gates: no pair is missed and, on a full run, at most kAddedPercentLimit is added.
std::vector<Gate> false_positive_gates(const AddedFalsePositives& added, bool full_run);

}  // namespace cab::perf
