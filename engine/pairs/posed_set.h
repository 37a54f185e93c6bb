// Poses the instances that a worker is about to test, and makes their boxes. They stay in cache until their pairs are
// tested, and an instance without a candidate is not posed again. Where the step `bound` keeps boxes of a batch
// (BoundInput::keeps_boxes), these are copied and not posed again.
#pragma once

#include "engine/step/candidate.h"
#include "engine/step/frame_context.h"
#include "layout/pair_list.h"

namespace cab {

struct PoseScratch;

// Up to sixteen instances of one batch in a worker's set. Their boxes are stored by instance: node n of lane i is
// boxes[i * nodes + n].
struct PosedTile {
  TileInstances instances;
  Placement placement[kLanes];  // by lane
  std::uint32_t batch;          // index of the batch
  std::uint32_t nodes;          // boxes per instance: all nodes if the batch has strategy `tree`, else the leaves
  BoxAos* boxes;                // AabbAos in the same memory with an axis-aligned refit
  float* leaf_bounds;           // by lane, filled if compares_leaf_bounds (layout/leaf_bounds_soa.h)
};

// An entry of a worker's hash table, which finds the slot of an instance by its key. Empty unless `generation` equals
// that of the set.
struct PosedEntry {
  std::uint64_t key;  // instance_key
  std::uint32_t generation;
  std::uint32_t slot;  // kLanes * index of the tile + lane
};

// The instances of the candidates that a worker has collected, each once, and their boxes.
struct PosedSet {
  FixedList<PosedTile> tiles;
  Span<std::uint32_t> open;      // by batch index: 1 + the index of its tile that has free lanes, 0 if none has
  Span<PosedEntry> entries;      // the hash table; its size is a power of two
  FixedList<BoxAos> boxes;       // the boxes of all tiles
  FixedList<float> leaf_bounds;  // the leaf bounds of all tiles
  std::uint32_t generation = 1;

  const PosedTile& tile_of(std::uint32_t slot) const { return tiles.data[slot / kLanes]; }
  const Placement& placement(std::uint32_t slot) const { return tile_of(slot).placement[slot % kLanes]; }
};

// Capacity of a worker's set: tiles, boxes (31 per instance, the nodes over 16 leaves) and floats of leaf bounds (16
// leaves per instance). Only two tiles of larger articulations may need more. This is little enough to stay in the
// second level of cache, and enough that few instances are posed more than once.
inline constexpr std::uint32_t kPosedTiles = 24;
inline constexpr std::size_t kPosedBoxes = kPosedTiles * kLanes * 31;
inline constexpr std::size_t kPosedLeafFloats = kPosedTiles * kLanes * 6 * kLanes;

// How a candidate is tested: by descent of two trees, if both instances have strategy `tree`, or by comparing the
// bounds of leaves, those of link boxes where an instance has strategy `links`. Overlapping link boxes are then opened.
// `brute` is the strategy of all batches, or of none.
inline bool descends_trees(const FrameContext& frame, const Candidate& candidate) {
  return frame.batch(candidate.batch_a).strategy == Strategy::kTree &&
         frame.batch(candidate.batch_b).strategy == Strategy::kTree;
}
inline bool opens_links(const FrameContext& frame, const Candidate& candidate) {
  return frame.batch(candidate.batch_a).strategy == Strategy::kLinks ||
         frame.batch(candidate.batch_b).strategy == Strategy::kLinks;
}

// Whether link boxes of one instance meet leaf boxes of the other. Then their bounds decide, without a box test: a link
// box allows for what the leaf predicate rounds on its own side alone (docs/proof.md, step 6.9).
inline bool links_meet_leaves(const FrameContext& frame, const Candidate& candidate) {
  return (frame.batch(candidate.batch_a).strategy == Strategy::kLinks) !=
         (frame.batch(candidate.batch_b).strategy == Strategy::kLinks);
}

// Whether any candidate of a frame is tested by the bounds of leaves. strategy: FrameContext::policies.
inline bool compares_leaf_bounds(Strategy strategy) {
  return strategy == Strategy::kRows || strategy == Strategy::kLinks || strategy == Strategy::kAuto;
}

// Whether so few tiles of an articulation fit a worker's set that candidates wait, until those of the same instances
// can be tested together.
bool is_large(const Articulation& articulation);

// Whether the set has room for both instances of a candidate.
bool has_room(const FrameContext& frame, const Candidate& candidate, PosedSet& set);

// Returns the slot of an instance. An instance that is not in the set is added, for which there must be room; of a
// batch whose boxes are kept, all given instances are, which are one tile.
std::uint32_t acquire_slot(const FrameContext& frame, std::uint32_t batch, std::uint32_t instance, PosedSet& set);

// Makes the boxes and leaf bounds of every instance of the set, as the strategy needs them. Poses those whose boxes are
// not kept, and returns how many these are.
std::uint32_t pose_set(const FrameContext& frame, PosedSet& set, PoseScratch& scratch);

// Removes all instances from the set.
void clear_set(PosedSet& set);

}  // namespace cab
