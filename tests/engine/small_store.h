// A hit store that is smaller than engines make it, so that frames with few hits make it grow.
#pragma once

#include "engine/session/engine.h"

namespace cab::tests {

// Leaves the engine one block for the hits of its next frame, and forgets those of the last one.
inline void shrink_store(Engine& engine) {
  HitStore& store = engine.hit_store;
  if (store.blocks == 0) return;
  store.reset({store.segments[0].words, kBlockWords}, std::make_unique<Arena>(engine.allocator));
}

// Whether a frame had more hits than the store began with.
inline bool has_grown(const Engine& engine) { return engine.hit_store.segment_count > 1; }

}  // namespace cab::tests
