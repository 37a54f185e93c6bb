// Creating engines, articulations and batches, and asking about them.
#include "engine/engine.h"

#include "engine/frame.h"
#include "engine/rest_pose.h"
#include "engine/traverse.h"
#include "engine/update.h"
#include "engine/validate.h"
#include "kernels/float_mode.h"
#include "layout/fit_box.h"
#include "layout/leaf_bounds_soa.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <new>

namespace cab {
namespace {

// Runs an add or create; whatever memory it lacked is a status.
template <class Body>
Status guarded(Body&& body) noexcept {
  try {
    return body();
  } catch (const std::bad_alloc&) { return Status::kOutOfMemory; } catch (const std::exception&) {
    return Status::kOutOfMemory;
  }
}

// What every worker must hold, over all batches of an engine.
struct Needs {
  std::size_t nodes = 0;
  std::size_t joints = 0;
  std::size_t depth = 0;
  std::size_t leaf_pairs = 0;
  std::size_t character_instances = 0;
  std::size_t character_nodes = 0;     // of the largest articulation
  std::size_t leaf_bounds_floats = 0;  // likewise
  std::size_t character_tiles = 0;
  bool several_leaves = false;  // some link of a character has
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
      needs.character_instances += batch.instance_count;
      needs.character_tiles += tile_count(batch.instance_count);
      needs.several_leaves = needs.several_leaves || batch.link_bounds->has_several_leaves;
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

void size_set(Worker& worker, const Needs& needs, std::size_t batch_count) {
  constexpr std::size_t kEntries = 1024;
  static_assert(kEntries >= 2 * kPosedTiles * kLanes);
  PosedSet& set = worker.posed;
  // Two more than there are, since two are kept free.
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
  if (needs.character_instances) size_set(worker, needs, batch_count);
  worker.partners = make_list<Partner>(worker.arena, kPartnerCapacity);
  worker.hits = make_list<Hit>(worker.arena, kTaskHits);
  worker.words = make_list<std::uint32_t>(worker.arena, needs.character_instances ? kTaskWords : 0);
}

// Sizes fresh workers and shared lists for all batches, then replaces the old ones: nothing changes if memory fails.
void size_workers(Engine& engine) {
  const Needs needs = needs_of(engine);
  std::vector<std::unique_ptr<Worker>> workers;
  for (std::uint32_t w = 0; w < engine.tasks->worker_count(); ++w) {
    workers.push_back(std::make_unique<Worker>(engine.allocator));
    size_worker(*workers.back(), needs, engine.batches.size());
  }
  auto shared = std::make_unique<Arena>(engine.allocator);
  std::size_t buckets = 16;
  while (buckets < needs.character_instances) buckets *= 2;
  const auto entries = shared->allocate<GridEntry>(needs.character_instances ? needs.character_instances + 1 : 0);
  const auto placements = shared->allocate<Placement>(needs.character_instances);
  const auto bucket = shared->allocate<std::uint32_t>(needs.character_instances ? buckets + 1 : 0);
  constexpr std::size_t most_words = std::numeric_limits<std::uint32_t>::max();
  const auto store = shared->allocate<std::uint32_t>(std::min(kStoreWords * needs.character_instances, most_words));
  const auto paired = shared->allocate<std::uint64_t>((engine.batches.size() * engine.batches.size() + 63) / 64);
  const auto rules = shared->allocate<std::uint64_t>((2 * engine.batches.size() * engine.batches.size() + 63) / 64);
  engine.rule_bits = rules;
  engine.workers = std::move(workers);
  engine.shared_arena = std::move(shared);
  engine.grid.entries = entries;
  engine.grid.placements = placements;
  engine.grid.bucket = bucket;
  engine.store = store;
  engine.paired_bits = paired;
}

// Where each sequence's hierarchy stands in a worker's memory.
void place_sequences(Engine& engine) {
  std::uint32_t at = 0;
  for (const auto& slot : engine.batches) {
    if (slot->batch.kind != BatchKind::kSequence) continue;
    slot->batch.worker_nodes = at;
    at += slot->batch.articulation->node_count;
  }
}

const Articulation* find_articulation(const Engine& engine, ArticulationId id) {
  return id.value == 0 || id.value > engine.articulations.size() ? nullptr
                                                                 : &engine.articulations[id.value - 1]->articulation;
}

Box box_of(const BoxTile& tile, std::uint32_t lane) {
  Box box;
  for (int c = 0; c < 3; ++c) {
    box.center[c] = tile.center[c][lane];
    box.half[c] = tile.half[c][lane];
    for (int k = 0; k < 3; ++k) box.axis[k][c] = tile.axis[k][c][lane];
  }
  return box;
}

Box box_of(const AabbTile& tile, std::uint32_t lane) {
  Box box = {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0, 0, 0}};
  for (int c = 0; c < 3; ++c) {
    const double lo = static_cast<double>(tile.lo[c][lane]), hi = static_cast<double>(tile.hi[c][lane]);
    box.center[c] = static_cast<float>(0.5 * (lo + hi));
    const double half = std::max(hi - static_cast<double>(box.center[c]), static_cast<double>(box.center[c]) - lo);
    box.half[c] = static_cast<float>(half);
    if (static_cast<double>(box.half[c]) < half)
      box.half[c] = std::nextafter(box.half[c], std::numeric_limits<float>::infinity());
  }
  return box;
}

}  // namespace

Status create_engine(const EngineDesc& desc, Engine** out) noexcept {
  return guarded([&] {
    if (!out) return Status::kBadOutput;
    const kernel::KernelTable* kernels = kernel::find_kernels(desc.isa);
    if (!kernels) return Status::kIsaNotAvailable;
    if (desc.allocator && (!desc.allocator->allocate || !desc.allocator->release)) return Status::kBadAllocator;
    if (desc.scheduler && (desc.scheduler->worker_count == 0 || !desc.scheduler->parallel_for))
      return Status::kBadScheduler;
    auto engine = std::make_unique<Engine>();
    engine->allocator = desc.allocator ? *desc.allocator : default_allocator();
    engine->kernels = kernels;
    engine->tasks = desc.scheduler           ? make_caller_task_runner(*desc.scheduler)
                    : desc.thread_count == 1 ? make_serial_task_runner()
                                             : make_tbb_task_runner(desc.thread_count);
    for (std::uint32_t w = 0; w < engine->tasks->worker_count(); ++w)
      engine->workers.push_back(std::make_unique<Worker>(engine->allocator));
    *out = engine.release();
    return Status::kOk;
  });
}

void destroy_engine(Engine* engine) noexcept { delete engine; }

Status fit_box(Span<const float> vertices, Box* out) noexcept {
  return guarded([&] {
    const kernel::FloatMode mode;
    return fit_box_to_vertices(vertices, out);
  });
}

Status add_articulation(Engine& engine, const ArticulationDesc& desc, ArticulationId* out,
                        std::uint32_t* bad_element) noexcept {
  return guarded([&] {
    const Call call(engine);
    if (!call.admitted()) return Status::kBusy;
    if (!out) return Status::kBadOutput;
    const kernel::FloatMode mode;
    auto slot = std::make_unique<ArticulationSlot>(engine.allocator);
    if (const Status status = build_articulation(desc, slot->arena, &slot->articulation, bad_element);
        status != Status::kOk)
      return status;
    if (desc.rest_pose.data) {
      Arena scratch(engine.allocator);
      Span<const LinkPair> touching;
      if (const Status status =
              links_that_touch(*engine.kernels, slot->articulation, desc.rest_pose, scratch, &touching);
          status != Status::kOk)
        return status;
      ignore_at_rest(touching, slot->arena, slot->articulation);
    }
    if (const Status status = make_exact_shapes(slot->articulation, &slot->shapes, bad_element); status != Status::kOk)
      return status;
    build_link_bounds(slot->articulation, slot->arena, &slot->link_bounds);
    engine.articulations.push_back(std::move(slot));
    out->value = static_cast<std::uint32_t>(engine.articulations.size());
    return Status::kOk;
  });
}

Status add_batch(Engine& engine, const BatchDesc& desc, BatchId* out) noexcept {
  return guarded([&] {
    const Call call(engine);
    if (!call.admitted()) return Status::kBusy;
    if (!out) return Status::kBadOutput;
    const Articulation* articulation = find_articulation(engine, desc.articulation);
    if (!articulation) return Status::kUnknownArticulation;
    if (desc.kind > BatchKind::kSequence) return Status::kBadBatchKind;
    if (desc.instance_count == 0) return Status::kNoInstances;
    if (desc.instance_count > kMaxInstances || engine.batches.size() == kMaxBatches) return Status::kTooManyInstances;
    // Indices of grid entries are 32-bit numbers, and its buckets a power of two of them.
    if (needs_of(engine).character_instances + desc.instance_count > (std::size_t{1} << 31))
      return Status::kTooManyInstances;
    auto slot = std::make_unique<BatchSlot>(engine.allocator);
    InstanceBatch& batch = slot->batch;
    batch.articulation = articulation;
    batch.articulation_index = desc.articulation.value - 1;
    batch.link_bounds = &engine.articulations[batch.articulation_index]->link_bounds;
    batch.kind = desc.kind;
    batch.instance_count = desc.instance_count;
    if (desc.kind == BatchKind::kCharacters) {
      batch.bounds = slot->arena.allocate<InstanceBounds>(desc.instance_count);
      batch.stored = slot->arena.allocate<StoredHits>(desc.instance_count);
      batch.stored_before =
          slot->arena.allocate<std::size_t>((desc.instance_count + kStoredPerTask - 1) / kStoredPerTask);
      batch.live = slot->arena.allocate<std::uint16_t>(tile_count(desc.instance_count));
    }
    engine.batches.push_back(std::move(slot));
    try {
      size_workers(engine);
    } catch (...) {
      engine.batches.pop_back();
      throw;
    }
    place_sequences(engine);
    out->value = static_cast<std::uint32_t>(engine.batches.size());
    return Status::kOk;
  });
}

Status compute_boxes(Engine& engine, const BatchInput& input, const Policies& policies, Span<Box> boxes) noexcept {
  Call call(engine);
  if (!call.admitted()) return Status::kBusy;
  const kernel::FloatMode mode;
  if (const Status status = validate_policies(policies); status != Status::kOk) return status;
  if (const Status status = bind_inputs(engine, call, {&input, 1}); status != Status::kOk) return status;
  const InstanceBatch& batch = engine.batch(input.batch);
  const std::size_t nodes = batch.articulation->node_count;
  if (!boxes.data || boxes.size < nodes * batch.instance_count) return Status::kBadOutput;
  Worker& worker = *engine.workers[0];
  const bool axis_aligned = is_axis_aligned(policies.refit);
  Policies every_level = policies;
  every_level.strategy = Strategy::kTree;  // the strategies without a tree need no inner boxes
  for (std::uint32_t tile = 0; tile < tile_count(batch.instance_count); ++tile) {
    const std::uint32_t live = update_tile(engine, batch, every_level, 0, instances_of(batch, tile), true, worker,
                                           worker.boxes.data, worker.bounds.data);
    for (std::uint32_t lane = 0; lane < std::min(kLanes, batch.instance_count - tile * kLanes); ++lane) {
      Box* to = boxes.data + (std::size_t{tile} * kLanes + lane) * nodes;
      for (std::size_t n = 0; n < nodes; ++n) {
        to[n] = axis_aligned ? box_of(worker.bounds[n], lane) : box_of(worker.boxes[n], lane);
        if (!(live >> lane & 1)) to[n] = {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0, 0, 0}};
      }
    }
  }
  return Status::kOk;
}

Status articulation_info(const Engine& engine, ArticulationId id, ArticulationInfo* out) noexcept {
  const Articulation* articulation = find_articulation(engine, id);
  if (!articulation) return Status::kUnknownArticulation;
  if (!out) return Status::kBadOutput;
  *out = {articulation->link_count, articulation->leaf_count, articulation->node_count, articulation->program.depth,
          static_cast<std::uint32_t>(articulation->ignored_pairs.size)};
  return Status::kOk;
}

Status merge_steps(const Engine& engine, ArticulationId id, Span<MergeStep> steps) noexcept {
  const Articulation* articulation = find_articulation(engine, id);
  if (!articulation) return Status::kUnknownArticulation;
  if (steps.size < articulation->program.steps.size || (steps.size && !steps.data)) return Status::kBadOutput;
  std::copy(articulation->program.steps.begin(), articulation->program.steps.end(), steps.data);
  return Status::kOk;
}

Status ignored_pairs(const Engine& engine, ArticulationId id, Span<IgnoredPair> pairs) noexcept {
  const Articulation* articulation = find_articulation(engine, id);
  if (!articulation) return Status::kUnknownArticulation;
  if (pairs.size < articulation->ignored_pairs.size || (pairs.size && !pairs.data)) return Status::kBadOutput;
  std::copy(articulation->ignored_pairs.begin(), articulation->ignored_pairs.end(), pairs.data);
  return Status::kOk;
}

std::uint32_t engine_thread_count(const Engine& engine) noexcept { return engine.tasks->worker_count(); }

Isa engine_isa(const Engine& engine) noexcept { return engine.kernels->isa; }

bool isa_available(Isa isa) noexcept { return kernel::find_kernels(isa) != nullptr; }

}  // namespace cab
