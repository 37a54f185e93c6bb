// What a crowd makes of each batch, and the memory that it needs.
#pragma once

#include "engine/broad_phase/crowd.h"
#include "engine/step/frame_context.h"

namespace cab {

struct CrowdScratch;

// One in so many rows may stray from its band.
inline constexpr std::size_t kStraysShare = 4;

// How many sorted rows there is room for: those of strips with room for a quarter more, seams and strays, as long as
// strips have many rows; or those that are kept and all others.
inline constexpr std::size_t sorted_capacity(std::size_t rows) { return rows + rows / 8 * 5 + 600; }

// Calls take(stored batch) for the batches of characters in the current frame, in order.
template <class Take>
void for_each_crowd_batch(StoredBatches batches, Take&& take) {
  for (const auto& stored : batches)
    if (stored->in_use() && stored->batch.input && stored->batch.kind == BatchKind::kCharacters) take(*stored);
}

// Whether instances have more than an origin: an orientation, a scale or a margin of their own.
inline bool is_placed(const InstanceBatch& batch) {
  return !batch.input->orientations.empty() || !batch.input->scales.empty() || !batch.margins.empty();
}

// The quaternion of an instance's orientation, of no turn if it has none.
inline const float* turn_of(const InstanceBatch& batch, std::uint32_t instance) {
  static constexpr float kNoTurn[4] = {0, 0, 0, 1};
  const float* const given = orientation_of(batch, instance);
  return given ? given : kNoTurn;
}

// Makes the part of a new batch that does not depend on a frame. Throws std::bad_alloc.
void make_crowd_batch(StoredBatch& stored);

// Makes what depends on the frame's margin, on the stride of poses, and on whether instances are placed, if one of them
// has changed.
void make_shape(StoredBatch& stored, float margin);

// Sizes the crowd of an engine for so many tiles of characters and LeafWords. Throws std::bad_alloc.
void size_crowd(std::size_t tiles, std::size_t words, Arena& arena, Crowd& crowd);

// Sizes a worker's part of it. leaf_pairs: most of a candidate. Throws std::bad_alloc.
void size_crowd_scratch(std::size_t leaf_pairs, Arena& arena, CrowdScratch& scratch);

// How many bytes the crowd of an engine takes.
std::size_t bytes_of(const Crowd& crowd);

// Gives every batch of the frame its rows. Those that are by instance are all unused at first.
void lay_out_rows(StoredBatches batches, Crowd& crowd);

// The bounds in the world of an instance by words: its sides, or where these are at the end of their range, what its
// words say.
InstanceBounds bounds_of_sides(const float (&sides)[6], const LeafWords* words, std::uint32_t blocks);

// Writes the bounds of some places of a batch whose rows are by place to InstanceBatch::bounds.
void store_bounds(const Crowd& crowd, StoredBatch& stored, std::uint32_t first, std::uint32_t end);

// Writes the bounds of the crowd's last frame to InstanceBatch::bounds, for what reads them between frames.
void store_crowd_bounds(const Crowd& crowd, StoredBatch& stored);

}  // namespace cab
