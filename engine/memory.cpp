// Sizes the memory of the workers, and the memory that they share, from worst-case counts over all batches.
#include "engine/memory.h"

#include "engine/traverse.h"
#include "layout/leaf_bounds_soa.h"

#include <algorithm>

namespace cab {
namespace {

// The worst-case counts over all batches of an engine.
struct Needs {
  std::size_t nodes = 0;                // of one tile of all sequences, or of one tile of the largest character
  std::size_t joints = 0;               // of the articulation with most links
  std::size_t depth = 0;                // levels of the two deepest hierarchies together
  std::size_t leaf_pairs = 0;           // most leaf pairs of a candidate
  std::size_t character_instances = 0;  // over all batches of characters
  std::size_t character_nodes = 0;      // of the largest character
  std::size_t leaf_bounds_floats = 0;   // of an instance of the character with most leaves
  std::size_t character_tiles = 0;      // over all batches of characters
  bool several_leaves = false;          // whether a link of a character has several leaves
  bool large = false;                   // whether a character is_large
};

Needs needs_of(const Engine& engine) {
  Needs needs;
  std::size_t sequence_nodes = 0, leaves = 0, depth = 0;
  for (const auto& slot : engine.batches) {
    const InstanceBatch& batch = slot->batch;
    const Articulation& articulation = *batch.articulation;
    needs.joints = std::max<std::size_t>(needs.joints, articulation.link_count);
    leaves = std::max<std::size_t>(leaves, articulation.leaf_count);
    depth = std::max<std::size_t>(depth, articulation.program.depth);
    if (batch.kind == BatchKind::kSequence) {
      sequence_nodes += articulation.node_count;
    } else {
      needs.character_instances += batch.capacity;
      needs.character_tiles += tile_count(batch.capacity);
      needs.several_leaves = needs.several_leaves || batch.link_bounds->has_several_leaves;
      needs.large = needs.large || is_large(articulation);
      needs.character_nodes = std::max<std::size_t>(needs.character_nodes, articulation.node_count);
      needs.leaf_bounds_floats = std::max(needs.leaf_bounds_floats, leaf_bounds_floats(articulation.leaf_count));
    }
  }
  needs.nodes = std::max(needs.character_nodes, sequence_nodes);
  needs.depth = 2 * depth + 2;
  needs.leaf_pairs = leaves * leaves;
  return needs;
}

template <class T>
FixedList<T> make_list(Arena& arena, std::size_t capacity) {
  return {arena.allocate<T>(capacity).data, static_cast<std::uint32_t>(capacity), 0};
}

// Sizes what a worker needs for characters: the posed instances and, if links have several leaves, the posed links.
void size_posed_set(Worker& worker, const Needs& needs, std::size_t batch_count) {
  constexpr std::size_t kEntries = 1024;
  static_assert(kEntries >= 2 * kPosedTiles * kLanes);
  PosedSet& set = worker.posed;
  // Two tiles more than all characters fill: has_room answers at once while two tiles are free.
  const std::size_t tiles = std::min<std::size_t>(kPosedTiles, needs.character_tiles + 2);
  const auto capacity = [&](std::size_t of_tile, std::size_t most) {
    return std::max(2 * of_tile, std::min(most, tiles * of_tile));
  };
  set.tiles = make_list<PosedTile>(worker.arena, tiles);
  set.open = worker.arena.allocate<std::uint32_t>(batch_count);
  set.entries = worker.arena.allocate<PosedEntry>(kEntries);
  set.boxes = make_list<BoxAos>(worker.arena, capacity(kLanes * needs.character_nodes, kPosedBoxes));
  set.leaf_bounds = make_list<float>(worker.arena, capacity(kLanes * needs.leaf_bounds_floats, kPosedLeafFloats));
  if (!needs.several_leaves) return;
  worker.posed_links.boxes = make_list<BoxAos>(worker.arena, kPosedLinkLeaves);
  worker.posed_links.leaf_bounds = make_list<float>(worker.arena, 6 * std::size_t{kPosedLinkLeaves});
  worker.posed_links.entries = worker.arena.allocate<PosedLinkEntry>(set.boxes.capacity);
  worker.link_pairs = make_list<LeafPair>(worker.arena, worker.found.capacity);
}

void size_worker(Worker& worker, const Needs& needs, std::size_t batch_count) {
  worker.boxes = worker.arena.allocate<BoxTile>(needs.nodes);
  worker.bounds = worker.arena.allocate<AabbTile>(needs.nodes);
  worker.joints = worker.arena.allocate<PointTile>(needs.joints);
  worker.motions = worker.arena.allocate<MotionTile>(needs.joints);
  worker.moments = worker.arena.allocate<MomentTile>(needs.nodes);
  worker.live = worker.arena.allocate<std::uint32_t>(batch_count);
  worker.stack = make_list<NodePair>(worker.arena, kStackPairsPerLevel * needs.depth);
  worker.tile_stack = make_list<TilePair>(worker.arena, needs.depth);
  worker.tile_found = make_list<TilePair>(worker.arena, needs.leaf_pairs);
  const std::size_t found =
      std::min(kChunkCandidates * needs.leaf_pairs, std::max<std::size_t>(kChunkLeafPairs, needs.leaf_pairs));
  worker.found = make_list<LeafPair>(worker.arena, found + kLanes);
  worker.candidates = make_list<Candidate>(worker.arena, kChunkCandidates);
  worker.waiting = make_list<EntryPair>(worker.arena, needs.large ? kWaitingCandidates : 0);
  worker.convex_queues = worker.arena.allocate<ConvexQueue>(kConvexQueues);
  if (needs.character_instances) size_posed_set(worker, needs, batch_count);
  worker.partners = make_list<Partner>(worker.arena, kPartnerCapacity);
  worker.hits = make_list<Hit>(worker.arena, kTaskHits);
  worker.words = make_list<std::uint32_t>(worker.arena, needs.character_instances ? kTaskWords : 0);
}

// Sets where the nodes of each sequence start in Worker::boxes and Worker::bounds.
void place_sequences(Engine& engine) {
  std::uint32_t at = 0;
  for (const auto& slot : engine.batches) {
    if (slot->batch.kind != BatchKind::kSequence) continue;
    slot->batch.worker_nodes = at;
    at += slot->batch.articulation->node_count;
  }
}

}  // namespace

std::size_t character_count(const Engine& engine) { return needs_of(engine).character_instances; }

void size_memory(Engine& engine) {
  const Needs needs = needs_of(engine);
  std::vector<std::unique_ptr<Worker>> workers;
  for (std::uint32_t w = 0; w < engine.pool.tasks->worker_count(); ++w) {
    workers.push_back(std::make_unique<Worker>(engine.allocator));
    size_worker(*workers.back(), needs, engine.batches.size());
  }
  auto shared = std::make_unique<Arena>(engine.allocator);
  std::size_t buckets = 16;
  while (buckets < needs.character_instances) buckets *= 2;
  const auto entries = shared->allocate<GridEntry>(needs.character_instances ? needs.character_instances + 1 : 0);
  const auto placements = shared->allocate<Placement>(needs.character_instances);
  const auto bucket = shared->allocate<std::uint32_t>(needs.character_instances ? buckets + 1 : 0);
  const auto store = shared->allocate<std::uint32_t>(store_words(needs.character_instances));
  const auto paired = shared->allocate<std::uint64_t>((engine.batches.size() * engine.batches.size() + 63) / 64);
  const auto rules = shared->allocate<std::uint64_t>((2 * engine.batches.size() * engine.batches.size() + 63) / 64);
  engine.rule_bits = rules;
  engine.pool.workers = std::move(workers);
  engine.shared_arena = std::move(shared);
  engine.broad_phase.grid.entries = entries;
  engine.broad_phase.grid.placements = placements;
  engine.broad_phase.grid.bucket = bucket;
  engine.broad_phase.paired_bits = paired;
  engine.broad_phase.batch_count = engine.batches.size();
  engine.hit_store.words = store;
  place_sequences(engine);
}

}  // namespace cab
