#include "engine/broad_phase/first_pass.h"

#include "engine/broad_phase/crowd_batch.h"
#include "engine/broad_phase/crowd_scratch.h"
#include "engine/step/pose_scratch.h"
#include "engine/step/update.h"
#include "layout/atomic_words.h"
#include "layout/compiler.h"

#include <algorithm>
#include <cmath>

namespace cab {
namespace {

// Bounds of the leaves of a lane, out of the boxes that pose_leaves makes.
void take_posed_bounds(const AabbTile* leaves, std::uint32_t first, std::uint32_t count, std::uint32_t lane,
                       kernel::RigidTile& tile) {
  for (int c = 0; c < 3; ++c) {
    float lo = kernel::kNowhere, hi = -kernel::kNowhere;
    for (std::uint32_t n = 0; n < count; ++n) {
      const AabbTile& leaf = leaves[first + n];
      tile.lo[n][c][lane] = leaf.lo[c][lane];
      tile.hi[n][c][lane] = leaf.hi[c][lane];
      lo = std::min(lo, leaf.lo[c][lane]);
      hi = std::max(hi, leaf.hi[c][lane]);
    }
    tile.of_block.lo[c][lane] = lo;
    tile.of_block.hi[c][lane] = hi;
  }
}

// Bounds the leaves of a tile and writes their words. posed: bounds of its boxes, for the lanes that are not rigid, or
// null.
void bound_blocks(const FrameContext& frame, const CrowdBatch& crowd, const AabbTile* posed, std::uint32_t unposed,
                  LeafWords* const (&first_row)[kLanes], kernel::RigidTile& tile) {
  for (std::uint32_t b = 0; b < crowd.blocks; ++b) {
    tile.block = b;
    frame.kernels.bound_rigid_leaves(tile);
    if (posed)
      for (std::uint32_t lane = 0; lane < kLanes; ++lane)
        if (!(unposed >> lane & 1)) take_posed_bounds(posed, b * kLanes, crowd.block[b].leaves, lane, tile);
    tile.next_bytes = 0;
    LeafWords* rows[kLanes];
    for (std::uint32_t lane = 0; lane < kLanes; ++lane) rows[lane] = first_row[lane] + b;
    frame.kernels.make_leaf_words(tile, rows);
    if (b == 0) {
      tile.all = tile.of_block;
      continue;
    }
    for (int c = 0; c < 3; ++c)
      for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
        tile.all.lo[c][lane] = std::min(tile.all.lo[c][lane], tile.of_block.lo[c][lane]);
        tile.all.hi[c][lane] = std::max(tile.all.hi[c][lane], tile.of_block.hi[c][lane]);
      }
  }
}

// Writes the instances of a tile from a place of the batch's order on, unused lanes repeating the last one.
void find_instances(const StoredBatch& stored, std::uint32_t place, std::uint32_t given,
                    std::uint32_t (&instances)[kLanes]) {
  const Span<const std::uint32_t> listed = stored.batch.input->instances;
  const std::uint32_t* const order = stored.crowd.ordered ? stored.crowd.order.data
                                     : listed.empty()     ? nullptr  // data of an empty list may point anywhere
                                                          : listed.data;
  for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
    const std::uint32_t at = std::min(place + lane, given - 1);
    instances[lane] = order ? order[at] : at;
  }
}

// Writes where the poses of sixteen instances begin.
void find_poses(const InstanceBatch& batch, const std::uint32_t (&instances)[kLanes], const float* (&poses)[kLanes]) {
  for (std::uint32_t lane = 0; lane < kLanes; ++lane) poses[lane] = pose_of(batch, instances[lane]);
}

// Writes the origins of sixteen instances to a worker's scratch.
void take_origins(const InstanceBatch& batch, const std::uint32_t (&instances)[kLanes], CrowdScratch& scratch) {
  const double* const origins = batch.input->origins.empty() ? nullptr : batch.input->origins.data;
  for (std::uint32_t lane = 0; lane < kLanes; ++lane)
    for (std::uint32_t c = 0; c < 3; ++c)
      scratch.origins[c][lane] = origins ? origins[3 * std::size_t{instances[lane]} + c] : 0;
  for (std::uint32_t c = 0; c < 3; ++c)
    for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
      const double origin = scratch.origins[c][lane], pad = kWorldPad * std::fabs(origin);
      scratch.place.from_lo[c][lane] = origin - pad;
      scratch.place.from_hi[c][lane] = origin + pad;
    }
}

// Asks for what places sixteen instances.
void prefetch_places(const InstanceBatch& batch, const std::uint32_t (&instances)[kLanes]) {
  const BatchInput& input = *batch.input;
  for (const std::uint32_t i : instances) {
    if (!input.origins.empty()) prefetch_bytes(&input.origins.data[3 * std::size_t{i}], 3 * sizeof(double));
    if (!input.orientations.empty()) prefetch_line(&input.orientations.data[4 * std::size_t{i}]);
    if (!input.scales.empty()) prefetch_line(&input.scales.data[i]);
    if (!batch.margins.empty()) prefetch_line(&batch.margins.data[i]);
  }
}

// Writes what places sixteen instances besides their origins to a worker's scratch, if there is anything.
void take_places(const FrameContext& frame, const StoredBatch& stored, const std::uint32_t (&instances)[kLanes],
                 kernel::RigidTile& tile) {
  if (!stored.crowd.shape.placed) return;
  const InstanceBatch& batch = stored.batch;
  for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
    tile.orientations[lane] = turn_of(batch, instances[lane]);
    tile.scales[lane] = scale_of(batch, instances[lane]);
    tile.grown[lane] = grown_by(batch, instances[lane], frame.margin);
  }
}

// Makes the words of sixteen instances, whose poses and origins are in the worker's scratch. words: where they go.
// Returns which lanes are live, and writes the caller's flags.
std::uint32_t make_words(const FrameContext& frame, const StoredBatch& stored, const TileInstances& instances,
                         LeafWords* const (&words)[kLanes], CrowdScratch& scratch, PoseScratch& posing,
                         FrameStats& stats) {
  const InstanceBatch& batch = stored.batch;
  const CrowdBatch& own = stored.crowd;
  kernel::RigidTile& tile = scratch.tile;
  tile.shape = &own.shape;
  bound_blocks(frame, own, nullptr, 0, words, tile);
  std::uint32_t live = (2u << (instances.count - 1)) - 1;
  if ((tile.rigid & live) != live) {
    const std::uint32_t rigid = tile.rigid;
    live = update_and_flag_tile(frame, {&batch, instances, RefitScope::kLeaves, posing.boxes.data, posing.bounds.data},
                                posing, stats);
    frame.kernels.bound_boxes(posing.boxes.data, batch.articulation->leaf_count, posing.bounds.data);
    bound_blocks(frame, own, posing.bounds.data, rigid, words, tile);
  } else if (!batch.input->flags.empty()) {
    for (std::uint32_t lane = 0; lane < instances.count; ++lane)
      batch.input->flags.data[instances.instance[lane]] = kInstanceOk;
  }
  for (std::uint32_t lane = 0; lane < instances.count; ++lane)
    for (std::uint32_t b = 0; b < own.blocks; ++b)
      for (std::uint32_t c = 0; c < 3; ++c) words[lane][b].origin[c] = scratch.origins[c][lane];
  return live;
}

}  // namespace

void bound_crowd_tiles(const FrameContext& frame, StoredBatch& stored, std::uint32_t first, std::uint32_t end,
                       Crowd& crowd, CrowdScratch& scratch, PoseScratch& posing, FrameStats& stats) {
  InstanceBatch& batch = stored.batch;
  const CrowdBatch& own = stored.crowd;
  const std::uint32_t given = active_count(batch);
  std::uint32_t next[kLanes];
  find_instances(stored, first, given, next);
  find_poses(batch, next, scratch.tile.next);
  for (std::uint32_t place = first; place < end; place += kLanes) {
    const std::uint32_t row = own.first_row + place, ahead = place + kLanes;
    TileInstances instances;
    instances.count = std::min(kLanes, given - place);
    std::copy(next, next + kLanes, instances.instance);
    std::copy(scratch.tile.next, scratch.tile.next + kLanes, scratch.tile.poses);
    take_origins(batch, instances.instance, scratch);
    take_places(frame, stored, instances.instance, scratch.tile);
    scratch.tile.next_bytes = 0;
    if (ahead < given) {
      find_instances(stored, ahead, given, next);
      find_poses(batch, next, scratch.tile.next);
      scratch.tile.next_bytes = static_cast<std::uint32_t>(prefetched_bytes(batch));
      prefetch_places(batch, next);
    }
    LeafWords* words[kLanes];
    for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
      const std::uint32_t at = own.first_words + (place + lane) * own.blocks;
      words[lane] = lane < instances.count ? &crowd.words[at] : scratch.unused;
      if (lane < instances.count) crowd.rows[row + lane] = {own.index, instances.instance[lane], at};
      if (ahead + lane < given) prefetch_bytes(&crowd.words[at + kLanes * own.blocks], sizeof(LeafWords));
    }
    const std::uint32_t live = make_words(frame, stored, instances, words, scratch, posing, stats);
    scratch.place.all = &scratch.tile.all;
    scratch.place.there = live;
    for (std::uint32_t s = 0; s < 6; ++s) scratch.place.to[s] = crowd.side(s) + row;
    frame.kernels.place_tile(scratch.place, scratch.survey);
    const std::uint32_t all = (2u << (instances.count - 1)) - 1;
    const bool listed = !batch.input->instances.empty();
    for (std::uint32_t left = listed ? live : all & ~live; left; left &= left - 1) {
      const std::uint32_t instance = instances.instance[lowest_bit(left)];
      const auto bit = static_cast<std::uint16_t>(1u << instance % kLanes);
      if (listed)
        relaxed_or(batch.live[instance / kLanes], bit);
      else
        relaxed_and(batch.live[instance / kLanes], static_cast<std::uint16_t>(~bit));
    }
  }
}

std::uint32_t bound_by_instance(const FrameContext& frame, StoredBatch& stored, const TileInstances& instances,
                                Crowd& crowd, CrowdScratch& scratch, PoseScratch& posing, FrameStats& stats) {
  InstanceBatch& batch = stored.batch;
  const CrowdBatch& own = stored.crowd;
  std::uint32_t of_lanes[kLanes];
  LeafWords* words[kLanes];
  for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
    of_lanes[lane] = instances.instance[std::min(lane, instances.count - 1)];
    words[lane] = lane < instances.count ? &crowd.words[own.first_words + of_lanes[lane] * own.blocks] : scratch.unused;
  }
  find_poses(batch, of_lanes, scratch.tile.poses);
  take_origins(batch, of_lanes, scratch);
  take_places(frame, stored, of_lanes, scratch.tile);
  scratch.tile.next_bytes = 0;
  const std::uint32_t live = make_words(frame, stored, instances, words, scratch, posing, stats);
  alignas(64) float sides[6][kLanes];
  scratch.place.all = &scratch.tile.all;
  scratch.place.there = live;
  for (std::uint32_t s = 0; s < 6; ++s) scratch.place.to[s] = sides[s];
  frame.kernels.place_tile(scratch.place, scratch.survey);
  for (std::uint32_t left = live; left; left &= left - 1) {
    const std::uint32_t lane = lowest_bit(left), row = own.first_row + of_lanes[lane];
    const bool is_kept = batch.rest[of_lanes[lane]] & kKept;  // its row is elsewhere
    for (std::uint32_t s = 0; s < 6 && !is_kept; ++s) crowd.side(s)[row] = sides[s][lane];
    float own_sides[6];
    for (std::uint32_t s = 0; s < 6; ++s) own_sides[s] = sides[s][lane];
    batch.bounds[of_lanes[lane]] = bounds_of_sides(own_sides, words[lane], own.blocks);
  }
  return live;
}

}  // namespace cab
