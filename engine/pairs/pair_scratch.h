// What a worker needs to find the overlapping leaf pairs of candidates.
#pragma once

#include "engine/pairs/link_pairs.h"
#include "engine/pairs/posed_set.h"
#include "engine/step/candidate.h"
#include "layout/pair_list.h"

namespace cab {

// Most candidates that a worker collects before it tests them, and most leaf pairs of the candidates that it tests
// together. A single candidate may have more leaf pairs.
inline constexpr std::uint32_t kChunkCandidates = 256;
inline constexpr std::uint32_t kChunkLeafPairs = 1u << 16;

// Capacity of PairScratch::waiting, where an articulation is large.
inline constexpr std::uint32_t kWaitingCandidates = 8192;

// PairScratch::live of a sequence that is posed as balls and capsules, not as boxes.
inline constexpr std::uint32_t kPosedRound = 1u << kLanes;

struct PairScratch {
  FixedList<Candidate> candidates;  // collected, and not tested yet
  FixedList<RowPair> waiting;       // candidates of large articulations that are not collected yet
  PosedSet posed;                   // the instances of `candidates`
  PosedLinkSet posed_links;         // strategy `links`: posed leaves of links whose boxes overlap
  FixedList<LeafPair> link_pairs;   // strategy `links`: pairs of links whose boxes overlap
  FixedList<NodePair> stack;        // node pairs that a traversal has yet to test
  FixedList<LeafPair> found;        // overlapping leaf pairs, before the exact test

  // Of sequences.
  Span<std::uint32_t> live;        // by batch index: bits of the live lanes in the current tile, and kPosedRound
  FixedList<TilePair> tile_stack;  // node pairs of two tiles that a descent has yet to test
  FixedList<TilePair> tile_found;  // overlapping leaf pairs of two tiles
};

}  // namespace cab
