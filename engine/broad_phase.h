// Step 2 of a frame: which instances of character batches come near each other, by the bounds of their leaf boxes.
#pragma once

#include "engine/engine.h"

namespace cab {

// Bounds of a tile's instances in the world from their leaf boxes, widened by what forming them in double rounds.
void bound_instances(const Engine& engine, InstanceBatch& batch, std::uint32_t tile, const BoxTile* leaves);

// Lists every instance that takes part in a rule between characters, by the lower x of its bounds; returns how many.
std::uint32_t sort_instances(Engine& engine, const FrameJob& job);

// Walks the partners of one entry among later ones; every later one where `all` asks for tests without boxes. next gives
// one candidate at a time, lower (batch, instance) first.
class Partners {
 public:
  Partners(const Engine& engine, std::uint32_t entry_count, std::uint32_t entry, bool all)
      : engine_(engine), entry_count_(entry_count), entry_(entry), other_(entry + 1), all_(all) {}
  bool next(Candidate* out);

 private:
  const Engine& engine_;
  std::uint32_t entry_count_;
  std::uint32_t entry_;
  std::uint32_t other_;
  bool all_;
};

}  // namespace cab
