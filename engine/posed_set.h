// Step 3 of a frame for characters: the boxes of the instances that a worker is about to test. No boxes are stored for
// all instances. What is posed here stays in cache until its pairs are tested, and an instance that is tested against
// nothing is never refitted.
#pragma once

#include "engine/candidate.h"
#include "engine/frame_context.h"
#include "layout/box_aos.h"
#include "layout/pair_list.h"

namespace cab {

struct Worker;

// A tile of a worker's set: the boxes of instance `lane` stand at boxes + lane * nodes.
struct PosedTile {
  TileInstances instances;
  Placement placement[kLanes];
  std::uint32_t batch;
  std::uint32_t nodes;
  BoxAos* boxes;
  float* leaf_bounds;
};

// The slot of an instance in a worker's set: an entry of its hash table, empty unless `generation` is the set's.
struct PosedEntry {
  std::uint64_t key;
  std::uint32_t generation;
  std::uint32_t slot;
};

// Drops all entries of a table at once, by the next generation; once in 2^32 times they are emptied one by one.
template <class Entry>
void begin_generation(std::uint32_t& generation, Span<Entry> entries) {
  if (++generation != 0) return;
  for (Entry& entry : entries) entry = {};
  generation = 1;
}

// The instances whose boxes the candidates at hand need, each once, posed where they are tested.
struct PosedSet {
  FixedList<PosedTile> tiles;
  Span<std::uint32_t> open;      // by batch: one more than the index of its tile that takes instances, or 0
  Span<PosedEntry> entries;      // a power of two
  FixedList<BoxAos> boxes;       // an axis-aligned refit keeps AabbAos in the same memory
  FixedList<float> leaf_bounds;  // layout/leaf_bounds_soa.h
  std::uint32_t generation = 1;

  const PosedTile& tile_of(std::uint32_t slot) const { return tiles.data[slot / kLanes]; }
  const Placement& placement(std::uint32_t slot) const { return tile_of(slot).placement[slot % kLanes]; }
};

// Tiles that a worker's set holds at most, and the boxes that it has room for at least: little enough to stay in the
// second level of cache, enough that few instances are posed more than once.
inline constexpr std::uint32_t kPosedTiles = 24;
inline constexpr std::size_t kPosedBoxes = kPosedTiles * kLanes * 31;
inline constexpr std::size_t kPosedLeafFloats = kPosedTiles * kLanes * 6 * kLanes;

// Whether a strategy compares leaf bounds by rows; links does so with the boxes of links.
inline bool uses_leaf_bounds(Strategy strategy) { return strategy == Strategy::kRows || strategy == Strategy::kLinks; }

// Whether both instances of a candidate fit.
bool has_room(const FrameContext& frame, const Candidate& candidate, PosedSet& set);

// The slot of an instance, which joins the set if it is not in it; room must be left.
std::uint32_t acquire_slot(const FrameContext& frame, std::uint32_t batch, std::uint32_t instance,
                           const Placement& placement, PosedSet& set);

// Poses every instance of worker.posed, and refits those whose strategy descends.
void pose_set(const FrameContext& frame, Worker& worker);

void clear_set(PosedSet& set);

}  // namespace cab
