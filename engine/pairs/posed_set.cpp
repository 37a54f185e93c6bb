// The hash table, the tiles and the posing of a worker's set of instances.
#include "engine/pairs/posed_set.h"

#include "engine/step/generation.h"
#include "engine/step/pose_scratch.h"
#include "engine/step/update.h"
#include "layout/leaf_bounds_soa.h"

#include <algorithm>

namespace cab {
namespace {

// Most boxes that a tile takes, by any strategy.
std::uint32_t tile_boxes(const Articulation& articulation) { return kLanes * articulation.node_count; }

std::uint32_t tile_leaf_floats(const Articulation& articulation) {
  return static_cast<std::uint32_t>(kLanes * leaf_bounds_floats(articulation.leaf_count));
}

// The entry of a key, or the empty entry where it belongs.
PosedEntry& find_entry(PosedSet& set, std::uint64_t key) {
  const std::size_t mask = set.entries.size - 1;
  for (std::size_t at = (key * 0x9e3779b97f4a7c15u) >> 40 & mask;; at = (at + 1) & mask)
    if (PosedEntry& entry = set.entries[at]; entry.generation != set.generation || entry.key == key) return entry;
}

// Adds an empty tile for instances of a batch. index: of the batch.
void open_tile(const InstanceBatch& batch, std::uint32_t index, PosedSet& set) {
  const Articulation& articulation = *batch.active;
  PosedTile tile;
  tile.instances.count = 0;
  tile.batch = index;
  tile.nodes = batch.strategy == Strategy::kTree ? articulation.node_count : articulation.leaf_count;
  tile.boxes = set.boxes.end();
  tile.leaf_bounds = set.leaf_bounds.end();
  set.boxes.size += kLanes * tile.nodes;
  set.leaf_bounds.size += tile_leaf_floats(articulation);
  set.tiles.push(tile);
  set.open[index] = set.tiles.size;
}

// Gives an instance the next lane of the open tile of its batch, and returns its slot.
std::uint32_t take_slot(const InstanceBatch& owner, std::uint32_t batch, std::uint32_t instance, PosedSet& set) {
  const std::uint64_t key = instance_key(batch, instance);
  const std::uint32_t at = set.open[batch] - 1;
  PosedTile& tile = set.tiles.data[at];
  const std::uint32_t lane = tile.instances.count++, slot = at * kLanes + lane;
  find_entry(set, key) = {key, set.generation, slot};
  tile.instances.instance[lane] = instance;
  tile.placement[lane] = placement_of(owner, instance);
  if (tile.instances.count == kLanes) set.open[batch] = 0;
  return slot;
}

}  // namespace

bool is_large(const Articulation& articulation) {
  constexpr std::size_t kFewTiles = 6;
  return kFewTiles * tile_boxes(articulation) > kPosedBoxes ||
         kFewTiles * tile_leaf_floats(articulation) > kPosedLeafFloats;
}

bool has_room(const FrameContext& frame, const Candidate& candidate, PosedSet& set) {
  const auto fit = [&](bool tile_a, bool tile_b) {
    const Articulation& a = *frame.batch(candidate.batch_a).active;
    const Articulation& b = *frame.batch(candidate.batch_b).active;
    const auto both = [=](std::size_t of_a, std::size_t of_b) { return tile_a * of_a + tile_b * of_b; };
    return set.tiles.size + both(1, 1) <= set.tiles.capacity &&
           set.boxes.size + both(tile_boxes(a), tile_boxes(b)) <= set.boxes.capacity &&
           set.leaf_bounds.size + both(tile_leaf_floats(a), tile_leaf_floats(b)) <= set.leaf_bounds.capacity;
  };
  if (fit(true, true)) return true;
  // No room for two new tiles. An instance already in the set, or one that fits an open tile, needs none.
  const auto is_new = [&set](std::uint32_t batch, std::uint32_t instance) {
    return std::uint32_t{find_entry(set, instance_key(batch, instance)).generation != set.generation};
  };
  const auto free_lanes = [&set](std::uint32_t batch) {
    return set.open[batch] == 0 ? 0 : kLanes - set.tiles.data[set.open[batch] - 1].instances.count;
  };
  const std::uint32_t new_a = is_new(candidate.batch_a, candidate.instance_a),
                      new_b = is_within(candidate) ? 0 : is_new(candidate.batch_b, candidate.instance_b);
  if (candidate.batch_a == candidate.batch_b) return fit(new_a + new_b > free_lanes(candidate.batch_a), false);
  return fit(new_a > free_lanes(candidate.batch_a), new_b > free_lanes(candidate.batch_b));
}

std::uint32_t acquire_slot(const FrameContext& frame, std::uint32_t batch, std::uint32_t instance, PosedSet& set) {
  const std::uint64_t key = instance_key(batch, instance);
  if (const PosedEntry& entry = find_entry(set, key); entry.generation == set.generation) return entry.slot;
  const InstanceBatch& owner = frame.batch(batch);
  if (set.open[batch] == 0) open_tile(owner, batch, set);
  if (!owner.keeps_boxes) {
    prefetch_pose(owner, instance);
    return take_slot(owner, batch, instance, set);
  }
  // Boxes that are kept are in the lanes of the only tile that the batch has.
  const TileInstances all = instances_of(owner, 0);
  for (std::uint32_t lane = 0; lane < all.count; ++lane) take_slot(owner, batch, all.instance[lane], set);
  return find_entry(set, key).slot;
}

namespace {

// Copies the boxes of few instances and their bounds from tiles of leaves as lanes.
void copy_leaves(const FrameContext& frame, const InstanceBatch& batch, const PosedTile& tile) {
  const std::uint32_t leaves = batch.active->leaf_count, width = leaf_bounds_width(leaves);
  float* bounds = tile.leaf_bounds;
  for (std::uint32_t i = 0; i < tile.instances.count; ++i) {
    const std::uint32_t begin = i * tile_count(leaves);
    for (std::uint32_t first = 0; first < leaves; first += kLanes)
      frame.kernels.boxes_to_aos(&batch.leaf_boxes[begin + first / kLanes], 1, std::min(kLanes, leaves - first),
                                 tile.boxes + std::size_t{i} * tile.nodes + first, 1);
    if (!compares_leaf_bounds(frame.policies.strategy)) continue;
    for (std::uint32_t side = 0; side < 6; ++side, bounds += width) {
      for (std::uint32_t first = 0; first < leaves; first += kLanes) {
        const AabbTile& from = batch.leaf_bounds[begin + first / kLanes];
        std::copy_n(side < 3 ? from.lo[side] : from.hi[side - 3], kLanes, bounds + first);
      }
      std::fill(bounds + leaves, bounds + width, side < 3 ? kNoLeafLo : -kNoLeafLo);
    }
  }
}

}  // namespace

std::uint32_t pose_set(const FrameContext& frame, PosedSet& set, PoseScratch& scratch) {
  const Policies& policies = frame.policies;
  const kernel::KernelTable& kernels = frame.kernels;
  std::uint32_t posed = 0;
  for (const PosedTile& tile : set.tiles) {
    const InstanceBatch& batch = frame.batch(tile.batch);
    if (keeps_leaves_as_lanes(batch, policies.refit)) {
      copy_leaves(frame, batch, tile);
      continue;
    }
    const std::uint32_t leaves = batch.active->leaf_count, count = tile.instances.count;
    const BoxTile* const boxes = batch.keeps_boxes ? batch.leaf_boxes.data : scratch.boxes.data;
    const AabbTile* const bounds = batch.keeps_boxes ? batch.leaf_bounds.data : scratch.bounds.data;
    if (!batch.keeps_boxes) {
      posed += count;
      const RefitScope scope = refit_scope(batch.strategy, *batch.active);
      update_tile(frame, {&batch, tile.instances, scope, scratch.boxes.data, scratch.bounds.data}, scratch);
    }
    if (is_axis_aligned(policies.refit))
      kernels.aabbs_to_aos(bounds, tile.nodes, count, reinterpret_cast<AabbAos*>(tile.boxes), tile.nodes);
    else
      kernels.boxes_to_aos(boxes, tile.nodes, count, tile.boxes, tile.nodes);
    if (!compares_leaf_bounds(policies.strategy)) continue;
    if (!is_axis_aligned(policies.refit) && !batch.keeps_boxes) kernels.bound_boxes(boxes, leaves, scratch.bounds.data);
    kernels.bounds_to_soa(bounds, leaves, count, tile.leaf_bounds);
  }
  return posed;
}

void clear_set(PosedSet& set) {
  for (const PosedTile& tile : set.tiles) set.open[tile.batch] = 0;
  set.tiles.clear();
  set.boxes.clear();
  set.leaf_bounds.clear();
  begin_generation(set.generation, set.entries);
}

}  // namespace cab
