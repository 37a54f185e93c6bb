// Sizes the memory of the workers, and the memory that they share, from worst-case counts over all batches.
#include "engine/session/memory.h"

#include "engine/broad_phase/crowd_batch.h"
#include "engine/pairs/traverse.h"
#include "engine/session/make_list.h"
#include "engine/session/rest.h"
#include "engine/session/static_bodies.h"
#include "engine/session/worker.h"
#include "layout/leaf_bounds_soa.h"

#include <algorithm>
#include <iterator>

namespace cab {
namespace {

// The most that one articulation asks for, over several of them.
struct Extremes {
  std::size_t leaves = 0, depth = 0;

  void add(const Articulation& articulation, MemoryNeeds& needs) {
    needs.joints = std::max<std::size_t>(needs.joints, articulation.link_count);
    const Articulation& posed = posed_articulation(articulation);
    needs.skin = std::max(needs.skin, skin_tiles(posed));
    needs.skin_rows = std::max(needs.skin_rows, skin_rows(posed));
    if (has_skin(posed)) needs.skin_leaves = std::max<std::size_t>(needs.skin_leaves, posed.leaf_count);
    const SurfaceLeaves& surface = articulation.surface;
    needs.surface_bones = std::max<std::size_t>(needs.surface_bones, surface.most_bones);
    needs.surface_blocks = std::max<std::size_t>(needs.surface_blocks, surface.most_blocks);
    needs.surface_patches = std::max<std::size_t>(needs.surface_patches, surface.most_patches);
    const SurfaceParts& parts = articulation.surface_parts;
    needs.closed_leaves = std::max(needs.closed_leaves, parts.leaves.size);
    if (!parts.leaves.empty()) needs.surface_parts = std::max(needs.surface_parts, parts.parts.size);
    leaves = std::max<std::size_t>(leaves, articulation.leaf_count);
    depth = std::max<std::size_t>(depth, articulation.program.depth);
    needs.depth = 2 * depth + 2;
    needs.leaf_pairs = leaves * leaves;
  }
};

// Counts an articulation as that of characters.
void add_character(const Articulation& articulation, const LinkBounds& link_bounds, MemoryNeeds& needs) {
  needs.several_leaves = needs.several_leaves || link_bounds.has_several_leaves;
  needs.large = needs.large || is_large(articulation);
  needs.character_nodes = std::max<std::size_t>(needs.character_nodes, articulation.node_count);
  needs.leaf_bounds_floats = std::max(needs.leaf_bounds_floats, leaf_bounds_floats(articulation.leaf_count));
  needs.nodes = std::max<std::size_t>(needs.nodes, posed_articulation(articulation).node_count);
}

MemoryNeeds needs_of(const Engine& engine) {
  MemoryNeeds needs;
  Extremes extremes;
  std::size_t sequence_nodes = 0;
  bool has_round = false;
  for (const auto& slot : engine.batches) {
    if (!slot->in_use()) continue;
    const InstanceBatch& batch = slot->batch;
    extremes.add(*batch.articulation, needs);
    if (batch.kind == BatchKind::kSequence) {
      sequence_nodes += posed_articulation(*batch.articulation).node_count;
      needs.sequence_links = std::max<std::size_t>(needs.sequence_links, batch.articulation->link_count);
      has_round = has_round || !slot->convex_shapes->round.leaves.empty();
    } else {
      needs.character_instances += batch.capacity;
      needs.character_tiles += tile_count(batch.capacity);
      needs.leaf_tiles += std::size_t{batch.capacity} * tile_count(batch.articulation->leaf_count);
      needs.crowd_words += std::size_t{batch.capacity} * slot->crowd.blocks;
      add_character(*batch.articulation, *batch.link_bounds, needs);
    }
  }
  needs.nodes = std::max(needs.nodes, sequence_nodes);
  needs.round_nodes = has_round ? sequence_nodes : 0;
  needs.batch_slots = engine.batches.size();
  return needs;
}

constexpr std::size_t MemoryNeeds::*kCounts[] = {&MemoryNeeds::nodes,
                                                 &MemoryNeeds::round_nodes,
                                                 &MemoryNeeds::joints,
                                                 &MemoryNeeds::skin_rows,
                                                 &MemoryNeeds::skin_leaves,
                                                 &MemoryNeeds::surface_bones,
                                                 &MemoryNeeds::surface_blocks,
                                                 &MemoryNeeds::surface_patches,
                                                 &MemoryNeeds::closed_leaves,
                                                 &MemoryNeeds::surface_parts,
                                                 &MemoryNeeds::skin,
                                                 &MemoryNeeds::sequence_links,
                                                 &MemoryNeeds::depth,
                                                 &MemoryNeeds::leaf_pairs,
                                                 &MemoryNeeds::character_instances,
                                                 &MemoryNeeds::character_nodes,
                                                 &MemoryNeeds::leaf_tiles,
                                                 &MemoryNeeds::leaf_bounds_floats,
                                                 &MemoryNeeds::character_tiles,
                                                 &MemoryNeeds::batch_slots,
                                                 &MemoryNeeds::crowd_words,
                                                 &MemoryNeeds::hits,
                                                 &MemoryNeeds::queries};

// The larger of each pair of counts.
MemoryNeeds larger(const MemoryNeeds& x, const MemoryNeeds& y) {
  MemoryNeeds out;
  for (const auto count : kCounts) out.*count = std::max(x.*count, y.*count);
  out.several_leaves = x.several_leaves || y.several_leaves;
  out.large = x.large || y.large;
  return out;
}

// Whether memory that is sized for x suffices for y.
bool suffices(const MemoryNeeds& x, const MemoryNeeds& y) {
  return std::all_of(std::begin(kCounts), std::end(kCounts), [&](const auto count) { return x.*count >= y.*count; }) &&
         (x.several_leaves || !y.several_leaves) && (x.large || !y.large);
}

// Sizes what a worker needs for characters: the posed instances and, if links have several leaves, the posed links.
void size_posed_set(PairScratch& pairs, Arena& arena, const MemoryNeeds& needs) {
  constexpr std::size_t kEntries = 1024;
  static_assert(kEntries >= 2 * kPosedTiles * kLanes);
  PosedSet& set = pairs.posed;
  // Two tiles more than all characters fill: has_room answers at once while two tiles are free.
  const std::size_t tiles = std::min<std::size_t>(kPosedTiles, needs.character_tiles + 2);
  const auto capacity = [&](std::size_t of_tile, std::size_t most) {
    return std::max(2 * of_tile, std::min(most, tiles * of_tile));
  };
  set.tiles = make_list<PosedTile>(arena, tiles);
  set.open = arena.allocate<std::uint32_t>(needs.batch_slots);
  set.entries = arena.allocate<PosedEntry>(kEntries);
  set.boxes = make_list<BoxAos>(arena, capacity(kLanes * needs.character_nodes, kPosedBoxes));
  set.leaf_bounds = make_list<float>(arena, capacity(kLanes * needs.leaf_bounds_floats, kPosedLeafFloats));
  if (!needs.several_leaves) return;
  pairs.posed_links.boxes = make_list<BoxAos>(arena, kPosedLinkLeaves);
  pairs.posed_links.leaf_bounds = make_list<float>(arena, 6 * std::size_t{kPosedLinkLeaves});
  pairs.posed_links.entries = arena.allocate<PosedLinkEntry>(set.boxes.capacity);
  pairs.link_pairs = make_list<LeafPair>(arena, pairs.found.capacity);
}

// Sizes what reads need.
void size_for_reads(Worker& worker, const MemoryNeeds& needs) {
  Arena& arena = worker.arena;
  PoseScratch& pose = worker.pose;
  pose.boxes = arena.allocate<BoxTile>(needs.nodes);
  pose.bounds = arena.allocate<AabbTile>(needs.nodes);
  pose.joints = arena.allocate<PointTile>(needs.joints);
  pose.motions = arena.allocate<MotionTile>(needs.joints);
  pose.skin = arena.allocate<MotionTile>(needs.skin);
  pose.skin_rows = arena.allocate<float>(kernel::kRowFloats, needs.skin_rows);
  pose.grown = arena.allocate<kernel::GrownTile>(needs.skin_leaves);
  pose.last_motions = arena.allocate<MotionTile>(needs.joints);
  worker.exact.queues = arena.allocate<ConvexQueue>(kConvexQueues);
  size_skin_cache({needs.surface_blocks, needs.surface_patches, needs.surface_bones}, arena, worker.exact.skins);
  if (needs.surface_patches) size_triangle_hulls(arena, worker.exact.triangles);
  size_inside({needs.closed_leaves, needs.surface_parts, needs.surface_patches, needs.joints}, arena,
              worker.exact.inside);
}

void size_worker(Worker& worker, const MemoryNeeds& needs) {
  size_for_reads(worker, needs);
  Arena& arena = worker.arena;
  worker.pose.round = arena.allocate<RoundTile>(needs.round_nodes);
  worker.pose.states = arena.allocate<double>(7 * kLanes * needs.sequence_links);
  worker.pose.state_poses = arena.allocate<float>(7 * kLanes * needs.sequence_links);
  worker.pose.links = arena.allocate<kernel::RawPoses>(needs.sequence_links);
  PairScratch& pairs = worker.pairs;
  pairs.live = arena.allocate<std::uint32_t>(needs.batch_slots);
  pairs.stack = make_list<NodePair>(arena, kStackPairsPerLevel * needs.depth);
  pairs.tile_stack = make_list<TilePair>(arena, needs.depth);
  pairs.tile_found = make_list<TilePair>(arena, needs.leaf_pairs);
  const std::size_t found =
      std::min(kChunkCandidates * needs.leaf_pairs, std::max<std::size_t>(kChunkLeafPairs, needs.leaf_pairs));
  pairs.found = make_list<LeafPair>(arena, found + kLanes);
  pairs.candidates = make_list<Candidate>(arena, kChunkCandidates);
  pairs.waiting = make_list<RowPair>(arena, needs.large ? kWaitingCandidates : 0);
  worker.hits.hits = make_list<Hit>(arena, kTaskHits);
  if (needs.character_instances == 0) return;
  size_posed_set(pairs, arena, needs);
  worker.crowd = arena.allocate<CrowdScratch>(1);
  size_crowd_scratch(needs.leaf_pairs, arena, worker.crowd[0]);
}

// Sets where the nodes of each sequence start in PoseScratch::boxes, PoseScratch::bounds and PoseScratch::round.
void place_sequences(Engine& engine) {
  std::uint32_t at = 0;
  for (const auto& slot : engine.batches) {
    if (!slot->in_use() || slot->batch.kind != BatchKind::kSequence) continue;
    slot->batch.worker_nodes = at;
    at += posed_articulation(*slot->batch.articulation).node_count;
  }
}

// Makes places for copies of all batches, so that calls that read need none.
void size_reader(const Engine& engine, Reader& reader) {
  while (reader.batches.size() < engine.batches.size())
    reader.batches.push_back(std::make_unique<StoredBatch>(engine.allocator));
}

// Makes new workers and shared arrays for the given needs, then replaces the old ones. Of the readers the first stays.
void make_memory(const MemoryNeeds& needs, Engine& engine) {
  std::vector<WorkerPtr> workers;
  for (std::uint32_t w = 0; w < engine.pool.tasks->worker_count(); ++w) {
    workers.push_back(make_worker(engine.allocator));
    size_worker(*workers.back(), needs);
  }
  auto shared = std::make_unique<Arena>(engine.allocator), for_more_hits = std::make_unique<Arena>(engine.allocator);
  const auto store =
      shared->allocate<std::uint32_t>(kBlockWords, store_blocks(needs.character_instances, needs.hits, workers.size()));
  const std::size_t pairs = needs.batch_slots * needs.batch_slots;
  const auto paired = shared->allocate<std::uint64_t>((pairs + 63) / 64);
  const auto skipped = shared->allocate<std::uint64_t>(paired.size);
  const auto rules = shared->allocate<std::uint64_t>((4 * pairs + 63) / 64);
  const auto last_rules = shared->allocate<std::uint64_t>(rules.size);
  for (const auto& slot : engine.batches) store_crowd_bounds(engine.crowd, *slot);
  Crowd crowd;
  size_crowd(needs.character_instances ? needs.character_tiles : 0, needs.crowd_words, *shared, crowd);
  crowd.frames = engine.crowd.frames + 1;  // no batch has rows in the new memory
  if (needs.queries) {
    QueryIndexesPtr indexes = make_query_indexes();
    add_query_index(*indexes, needs, engine.allocator);
    engine.readers[0]->queries = make_query_memory(needs, workers.size(), engine.allocator);
    engine.query_indexes = std::move(indexes);
  }
  // From here on nothing throws: the store's words are in the memory that goes.
  engine.readers.resize(1);
  engine.rule_bits = rules;
  engine.pool.workers = std::move(workers);
  engine.shared_arena = std::move(shared);
  engine.rest.rule_bits = last_rules;
  engine.crowd = crowd;
  engine.paired.bits = paired;
  engine.paired.skipped = skipped;
  engine.paired.count = needs.batch_slots;
  engine.hit_store.reset(store, std::move(for_more_hits));
  engine.sized = needs;
  forget_rest(engine);
}

}  // namespace

PoseScratch& WorkerPool::pose_of(std::uint32_t worker) const { return workers[worker]->pose; }

ExactScratch& WorkerPool::exact_of(std::uint32_t worker) const { return workers[worker]->exact; }

WorkerPtr make_worker(const Allocator& allocator) { return WorkerPtr(new Worker(allocator)); }

void WorkerDelete::operator()(Worker* worker) const { delete worker; }

std::size_t character_count(const Engine& engine) { return needs_of(engine).character_instances; }

void size_memory(Engine& engine) {
  const MemoryNeeds needs = needs_of(engine);
  if (!engine.shared_arena || !suffices(engine.sized, needs)) make_memory(larger(engine.sized, needs), engine);
  for (const auto& reader : engine.readers) size_reader(engine, *reader);
  place_sequences(engine);
}

Reader& add_reader(Engine& engine) {
  const std::lock_guard one_at_a_time(engine.adding_reader);
  const Reader& first = *engine.readers[0];
  auto made = std::make_unique<Reader>();
  made->pool = &made->own_pool;
  made->own_pool.tasks = make_serial_task_runner();
  made->own_pool.workers.push_back(make_worker(engine.allocator));
  size_for_reads(made->own_pool[0], engine.sized);
  size_reader(engine, *made);
  if (first.queries) made->queries = make_query_memory(engine.sized, 1, engine.allocator);
  if (first.past) made->past = make_history_memory(*first.past, engine.histories.size(), engine.allocator);
  made->in_use = true;
  const std::lock_guard lock(engine.holders.mutex);
  engine.readers.reserve(engine.readers.size() + 1);
  if (first.queries) add_query_index(*engine.query_indexes, engine.sized, engine.allocator);
  engine.readers.push_back(std::move(made));
  return *engine.readers.back();
}

void reserve_memory(const ReserveDesc& desc, Engine& engine) {
  MemoryNeeds needs = needs_of(engine);
  Extremes extremes;
  std::size_t blocks = 0;
  std::uint32_t most_leaves = 0;
  for (const auto& slot : engine.articulations) {
    if (!slot->in_use()) continue;
    most_leaves = std::max<std::uint32_t>(most_leaves, slot->articulation.leaf_count);
    blocks = std::max(blocks, crowd_blocks(slot->articulation));
    extremes.add(slot->articulation, needs);
    add_character(slot->articulation, slot->link_bounds, needs);
  }
  needs.character_instances = std::max<std::size_t>(needs.character_instances, desc.characters);
  // Each batch may end in a tile that is not full.
  needs.character_tiles = std::max(needs.character_tiles, tile_count(desc.characters) + std::size_t{desc.batches});
  needs.batch_slots = std::max<std::size_t>(needs.batch_slots, desc.batches);
  needs.crowd_words = std::max(needs.crowd_words, desc.characters * blocks);
  needs.leaf_tiles = std::max(needs.leaf_tiles, desc.characters * std::size_t{tile_count(most_leaves)});
  needs.queries = desc.queries;
  needs.hits = desc.hits;
  if (!engine.shared_arena || !suffices(engine.sized, needs)) make_memory(larger(engine.sized, needs), engine);
  engine.batches.reserve(needs.batch_slots);
}

Status engine_memory(const Engine& engine, EngineMemory* out) noexcept {
  if (!out) return Status::kBadOutput;
  *out = {};
  for (const auto& slot : engine.articulations) out->articulations += slot->arena.bytes();
  for (const auto& slot : engine.batches)
    out->batches += slot->arena.bytes() + (slot->statics ? slot->statics->arena.bytes() : 0);
  const std::lock_guard lock(engine.holders.mutex);  // a call that reads may add a reader
  for (const auto& worker : engine.pool.workers) out->workers += worker->arena.bytes();
  for (const auto& reader : engine.readers)
    for (const auto& worker : reader->own_pool.workers) out->workers += worker->arena.bytes();
  out->broad_phase = bytes_of(engine.crowd);
  const HitStore& store = engine.hit_store;
  out->hits = std::size_t{store.blocks} * kBlockWords * sizeof(std::uint32_t);
  out->queries = query_bytes(engine);
  out->histories = history_bytes(engine);
  const std::size_t shared = engine.shared_arena ? engine.shared_arena->bytes() : 0;
  const std::size_t grown = store.grown ? store.grown->bytes() : 0;
  out->total = out->articulations + out->batches + out->workers + out->queries + out->histories + shared + grown;
  return Status::kOk;
}

}  // namespace cab
