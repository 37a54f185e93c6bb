// What a worker needs for the frame of a crowd.
#pragma once

#include "engine/broad_phase/crowd.h"
#include "engine/step/candidate.h"
#include "kernels/leaf_words.h"
#include "kernels/search_strip.h"

namespace cab {

struct CrowdScratch {
  kernel::RigidTile tile;
  kernel::PlaceTile place;
  kernel::CrowdSurvey survey;
  double origins[3][kLanes];
  kernel::PairSlots slots;
  LeafWords unused[kCrowdLeaves / kLanes];
  // Sorted rows of candidates that are not tested yet.
  std::uint32_t a[kernel::kMostPairEntries], b[kernel::kMostPairEntries];
  std::uint32_t count;
  Candidate candidates[kernel::kMostPairEntries];  // those that are tested
  Span<std::uint32_t> pairs;                       // leaf pairs to test, and in the second half those that overlap
  float reach, extent;                             // bands: the greatest of the rows in this worker's strips
  std::uint32_t kept;                              // how many instances rest and are in the kept strips
  std::uint32_t resting;                           // how many rest and are not
};

}  // namespace cab
