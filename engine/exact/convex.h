// Exact::kConvex: the convex shapes of leaf pairs whose boxes overlap, sixteen pairs of shapes per kernel call.
#pragma once

#include "engine/exact/exact.h"
#include "engine/exact/inside.h"
#include "engine/exact/skin_cache.h"
#include "engine/exact/triangle_hulls.h"
#include "engine/step/frame_context.h"
#include "kernels/convex/convex_block.h"
#include "layout/pair_list.h"

namespace cab {

struct Candidate;

// A block of pairs of shapes that fills up. Its kernel runs when it is full.
struct ConvexQueue {
  kernel::ConvexBlock block;
  std::uint32_t count = 0;     // of lanes in use
  std::uint32_t asks[kLanes];  // by lane: which leaf pair or hit asks
  std::uint64_t rank[kLanes];  // by lane: of equally deep contacts of a hit the one of the lowest rank counts
};

inline constexpr std::uint32_t kConvexQueues = kConvexKindCount * kConvexKindCount;

// What a worker needs for exact tests.
struct ExactScratch {
  Span<ConvexQueue> queues;  // one for each kind of a's shape and each kind of b's shape
  SkinCache skins;           // without places if no leaf has triangles
  TriangleHulls triangles;   // likewise
  InsideScratch inside;      // without lists if no part of a skin is closed
};

// The power of two that scales the sum of the reaches of two shapes to between 1/2 and 1, for ConvexBlock::scale. Sums
// below kLeastConvexReach count as that.
float scale_of_reach(float reach);

// Whether the pair of a lane touches: by the answer of the kernel, or in double where that decides nothing.
bool lane_touches(const kernel::ConvexBlock& block, const kernel::ConvexAnswer& answer, std::uint32_t lane);

// Removes from `found` the leaf pairs whose shapes do not touch. LeafPair::candidate is an index into `candidates`.
// Every other pair touches, or could not be shown to be apart.
void keep_touching(const FrameContext& frame, const Candidate* candidates, FixedList<LeafPair>& found,
                   ExactScratch& scratch, FrameStats& stats);

// Clears in `found` the lanes in which the shapes of two leaves do not touch. candidates: of the tile, by lane. The
// upper half of TilePair::lanes may name lanes that are known to touch.
void keep_touching_lanes(const FrameContext& frame, const Candidate (&candidates)[kLanes], FixedList<TilePair>& found,
                         ExactScratch& scratch, FrameStats& stats);

// ExactTest::contacts.
void convex_contacts(const FrameContext& frame, Span<const Hit> hits, Contact* contacts, ExactScratch& scratch);

}  // namespace cab
