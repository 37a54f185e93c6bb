// The first pass of a crowd's frame: what is kept of each instance, straight from its pose.
#pragma once

#include "engine/broad_phase/crowd.h"
#include "engine/step/candidate.h"
#include "engine/step/frame_context.h"
#include "kernels/search_strip.h"

namespace cab {

struct CrowdScratch;
struct PoseScratch;

// Bounds instances of a batch by tiles of sixteen, from place `first` of its order on up to `end` or a little farther:
// writes their rows, sides and words, clears the live bits of those that are masked (or sets the others', where
// instances are listed), and writes the caller's flags.
void bound_crowd_tiles(const FrameContext& frame, StoredBatch& stored, std::uint32_t first, std::uint32_t end,
                       Crowd& crowd, CrowdScratch& scratch, PoseScratch& posing, FrameStats& stats);

// The same for sixteen instances of a batch whose rows and words are by instance: writes their sides unless their row
// is kept, their words and InstanceBatch::bounds, and the caller's flags. Returns the bits of the lanes that are live.
std::uint32_t bound_by_instance(const FrameContext& frame, StoredBatch& stored, const TileInstances& instances,
                                Crowd& crowd, CrowdScratch& scratch, PoseScratch& posing, FrameStats& stats);

}  // namespace cab
