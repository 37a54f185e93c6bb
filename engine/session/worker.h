// What each thread that runs tasks needs, reused in every frame.
#pragma once

#include "engine/broad_phase/crowd_scratch.h"
#include "engine/exact/convex.h"
#include "engine/hits/report.h"
#include "engine/pairs/pair_scratch.h"
#include "engine/step/pose_scratch.h"
#include "layout/arena.h"

namespace cab {

// The memory of one worker. Whenever a batch is added, it is sized for the worst case of every rule
// (engine/session/memory.cpp).
struct alignas(64) Worker {
  explicit Worker(const Allocator& allocator) : arena(allocator) {}

  Arena arena;  // owns the arrays and lists below
  PoseScratch pose;
  PairScratch pairs;
  ExactScratch exact;
  HitScratch hits;
  Span<CrowdScratch> crowd;  // one, if there are characters
  FrameStats stats;          // of this frame
};

// Makes a worker ready for the tests of a call, whose poses are new.
inline void begin_counting(Worker& worker) {
  worker.stats = {};
  forget_skinned(worker.exact.skins);
  forget_inside(worker.exact.inside);
}

}  // namespace cab
