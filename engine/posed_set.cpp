#include "engine/posed_set.h"

#include "engine/broad_phase.h"
#include "engine/link_pairs.h"
#include "engine/update.h"
#include "layout/leaf_bounds_soa.h"

#include <algorithm>

namespace cab {
namespace {

std::uint32_t tile_boxes(const Articulation& articulation) { return kLanes * articulation.node_count; }

std::uint32_t tile_leaf_floats(const Articulation& articulation) {
  return static_cast<std::uint32_t>(kLanes * leaf_bounds_floats(articulation.leaf_count));
}

// Where the key stands, or the free entry where it belongs.
PosedEntry& find_entry(PosedSet& set, std::uint64_t key) {
  const std::size_t mask = set.entries.size - 1;
  for (std::size_t at = (key * 0x9e3779b97f4a7c15u) >> 40 & mask;; at = (at + 1) & mask)
    if (PosedEntry& entry = set.entries[at]; entry.generation != set.generation || entry.key == key) return entry;
}

// A tile for more instances of a batch.
void open_tile(const Articulation& articulation, const Policies& policies, std::uint32_t batch, PosedSet& set) {
  PosedTile tile;
  tile.instances.count = 0;
  tile.batch = batch;
  tile.nodes = boxes_made(articulation, policies);
  tile.boxes = set.boxes.end();
  tile.leaf_bounds = set.leaf_bounds.end();
  set.boxes.size += kLanes * tile.nodes;
  set.leaf_bounds.size += tile_leaf_floats(articulation);
  set.tiles.push(tile);
  set.open[batch] = set.tiles.size;
}

}  // namespace

bool has_room(const Engine& engine, const Candidate& candidate, Worker& worker) {
  PosedSet& set = worker.posed;
  const auto fit = [&](bool tile_a, bool tile_b) {
    const Articulation& a = *engine.batches[candidate.batch_a]->batch.active;
    const Articulation& b = *engine.batches[candidate.batch_b]->batch.active;
    const auto both = [=](std::size_t of_a, std::size_t of_b) { return tile_a * of_a + tile_b * of_b; };
    return set.tiles.size + both(1, 1) <= set.tiles.capacity &&
           set.boxes.size + both(tile_boxes(a), tile_boxes(b)) <= set.boxes.capacity &&
           set.leaf_bounds.size + both(tile_leaf_floats(a), tile_leaf_floats(b)) <= set.leaf_bounds.capacity;
  };
  if (fit(true, true)) return true;
  // Not for two new tiles; but who is in the set needs none, nor who fits into a tile that takes instances.
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

std::uint32_t acquire_slot(const Engine& engine, const Policies& policies, std::uint32_t batch, std::uint32_t instance,
                           const Placement& placement, Worker& worker) {
  PosedSet& set = worker.posed;
  const std::uint64_t key = instance_key(batch, instance);
  PosedEntry& entry = find_entry(set, key);
  if (entry.generation == set.generation) return entry.slot;
  const InstanceBatch& owner = engine.batches[batch]->batch;
  if (set.open[batch] == 0) open_tile(*owner.active, policies, batch, set);
  const std::uint32_t at = set.open[batch] - 1;
  PosedTile& tile = set.tiles.data[at];
  const std::uint32_t lane = tile.instances.count++;
  entry = {key, set.generation, at * kLanes + lane};
  tile.instances.instance[lane] = instance;
  tile.placement[lane] = placement;
  if (tile.instances.count == kLanes) set.open[batch] = 0;
  prefetch_pose(owner, instance);
  return entry.slot;
}

void pose_set(const Engine& engine, const Policies& policies, float margin, Worker& worker) {
  if (policies.strategy == Strategy::kExactAll) return;
  const kernel::KernelTable& kernels = *engine.kernels;
  for (const PosedTile& tile : worker.posed.tiles) {
    const InstanceBatch& batch = engine.batches[tile.batch]->batch;
    const std::uint32_t leaves = batch.active->leaf_count;
    update_tile(engine, batch, policies, margin, tile.instances, false, worker, worker.boxes.data, worker.bounds.data);
    if (is_axis_aligned(policies.refit))
      kernels.aabbs_to_aos(worker.bounds.data, tile.nodes, tile.instances.count, reinterpret_cast<AabbAos*>(tile.boxes),
                           tile.nodes);
    else
      kernels.boxes_to_aos(worker.boxes.data, tile.nodes, tile.instances.count, tile.boxes, tile.nodes);
    if (!uses_leaf_bounds(policies.strategy)) continue;
    if (!is_axis_aligned(policies.refit)) kernels.bound_boxes(worker.boxes.data, leaves, worker.bounds.data);
    kernels.bounds_to_soa(worker.bounds.data, leaves, tile.instances.count, tile.leaf_bounds);
  }
}

void clear_set(Worker& worker) {
  PosedSet& set = worker.posed;
  for (const PosedTile& tile : set.tiles) set.open[tile.batch] = 0;
  set.tiles.clear();
  set.boxes.clear();
  set.leaf_bounds.clear();
  clear_links(worker);
  begin_generation(set.generation, set.entries);
}

}  // namespace cab
