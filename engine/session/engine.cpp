// The public API except run_frame: makes engines, articulations and batches, computes boxes, and answers queries.
#include "engine/session/engine.h"

#include "engine/broad_phase/crowd_batch.h"
#include "engine/exact/hull.h"
#include "engine/session/call.h"
#include "engine/session/memory.h"
#include "engine/session/rest.h"
#include "engine/session/rest_pose.h"
#include "engine/session/slots.h"
#include "engine/session/static_bodies.h"
#include "engine/session/validate.h"
#include "engine/session/worker.h"
#include "engine/step/box_of.h"
#include "engine/step/update.h"
#include "kernels/find_kernels.h"
#include "kernels/float_mode.h"
#include "layout/fit_box.h"

#include <algorithm>

namespace cab {
namespace {

// Empties the slot of a batch.
void clear_slot(StoredBatch& slot) {
  slot.batch = {};
  slot.crowd = {};
  slot.fcl_shapes = nullptr;
  slot.convex_shapes = nullptr;
  slot.statics.reset();
  slot.arena.release();
}

// Makes room for the instances of a batch whose articulation and shapes are set, and puts it into a slot of the engine.
Status store_batch(Engine& engine, BatchKind kind, std::uint32_t count, std::unique_ptr<StoredBatch> slot,
                   BatchId* out) {
  // The numbers of rows and of sorted rows have 32 bits, and there are up to 1.7 times as many of these as characters.
  if (character_count(engine) + count > (std::size_t{1} << 31)) return Status::kTooManyInstances;
  InstanceBatch& batch = slot->batch;
  batch.kind = kind;
  batch.capacity = batch.instance_count = count;
  if (kind == BatchKind::kCharacters) {
    batch.bounds = slot->arena.allocate<InstanceBounds>(count);
    batch.hit_chains = slot->arena.allocate<HitChain>(count);
    batch.stored_before = slot->arena.allocate<std::size_t>((count + kWrittenPerTask - 1) / kWrittenPerTask);
    batch.live = slot->arena.allocate<std::uint16_t>(tile_count(count));
    batch.rest = slot->arena.allocate<std::uint8_t>(count);
    if (count <= kLanes && !batch.articulation->skin.empty()) {
      batch.leaf_boxes = slot->arena.allocate<BoxTile>(batch.articulation->leaf_count);
      batch.leaf_bounds = slot->arena.allocate<AabbTile>(batch.articulation->leaf_count);
    }
    make_crowd_batch(*slot);
    if (kChecksRest) batch.checksums = slot->arena.allocate<std::uint64_t>(count);
  }
  const std::size_t index = free_slot(engine.allocator, engine.batches);
  if (index == kMaxBatches) {
    engine.batches.pop_back();
    return Status::kTooManyInstances;
  }
  fill_slot(std::move(slot), engine.batches[index]);
  try {
    size_memory(engine);
  } catch (...) {
    clear_slot(*engine.batches[index]);
    throw;
  }
  forget_rest(engine);
  out->value = id_of(index, engine.batches);
  return Status::kOk;
}

}  // namespace

Status create_engine(const EngineDesc& desc, Engine** out) noexcept {
  return guarded([&] {
    if (!out) return Status::kBadOutput;
    const kernel::KernelTable* kernels = kernel::find_kernels(desc.isa);
    if (!kernels) return Status::kIsaNotAvailable;
    if (desc.allocator && (!desc.allocator->allocate || !desc.allocator->release)) return Status::kBadAllocator;
    if (desc.scheduler && (desc.scheduler->worker_count == 0 || desc.scheduler->worker_count > kMaxWorkers ||
                           !desc.scheduler->parallel_for))
      return Status::kBadScheduler;
    if (desc.profiler && (!desc.profiler->begin || !desc.profiler->end)) return Status::kBadProfiler;
    auto engine = std::make_unique<Engine>();
    engine->allocator = desc.allocator ? *desc.allocator : default_allocator();
    if (desc.profiler) engine->profiler = *desc.profiler;
    engine->kernels = kernels;
    engine->pool.tasks = desc.scheduler                         ? make_caller_task_runner(*desc.scheduler)
                         : desc.thread_count == 1 || !has_tbb() ? make_serial_task_runner()
                                                                : make_tbb_task_runner(desc.thread_count);
    engine->readers.push_back(std::make_unique<Reader>());
    engine->readers[0]->pool = &engine->pool;
    engine->frame = make_frame_in_progress(engine->pool.tasks->worker_count());
    for (std::uint32_t w = 0; w < engine->pool.tasks->worker_count(); ++w)
      engine->pool.workers.push_back(make_worker(engine->allocator));
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
    auto slot = std::make_unique<StoredArticulation>(engine.allocator);
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
    store_articulation(std::move(slot), engine, out);
    return Status::kOk;
  });
}

Status add_batch(Engine& engine, const BatchDesc& desc, BatchId* out) noexcept {
  return guarded([&] {
    const Call call(engine);
    if (!call.admitted()) return Status::kBusy;
    if (!out) return Status::kBadOutput;
    const StoredArticulation* const stored = find_stored(engine, desc.articulation);
    if (!stored) return Status::kUnknownArticulation;
    if (desc.kind > BatchKind::kSequence) return Status::kBadBatchKind;
    if (desc.instance_count == 0) return Status::kNoInstances;
    if (desc.instance_count > kMaxInstances) return Status::kTooManyInstances;
    auto slot = std::make_unique<StoredBatch>(engine.allocator);
    slot->batch.articulation = &stored->articulation;
    slot->batch.link_bounds = &stored->link_bounds;
    slot->fcl_shapes = stored->fcl_shapes.get();
    slot->convex_shapes = &stored->convex_shapes;
    return store_batch(engine, desc.kind, desc.instance_count, std::move(slot), out);
  });
}

Status add_static_batch(Engine& engine, const StaticDesc& desc, BatchId* out, std::uint32_t* bad_element) noexcept {
  return guarded([&] {
    const Call call(engine);
    if (!call.admitted()) return Status::kBusy;
    if (!out) return Status::kBadOutput;
    const kernel::FloatMode mode;
    auto slot = std::make_unique<StoredBatch>(engine.allocator);
    slot->statics = make_static_bodies(engine.allocator);
    StaticBodies& bodies = *slot->statics;
    if (const Status status = build_static_bodies(desc, *engine.kernels, &bodies, bad_element); status != Status::kOk)
      return status;
    slot->batch.articulation = &bodies.one;
    slot->batch.link_bounds = &bodies.link_bounds;
    slot->batch.own_boxes = bodies.leaves.leaf_box;
    slot->fcl_shapes = bodies.fcl_shapes.get();
    slot->convex_shapes = &bodies.convex_shapes;
    return store_batch(engine, BatchKind::kCharacters, bodies.leaves.leaf_count, std::move(slot), out);
  });
}

Status reserve(Engine& engine, const ReserveDesc& desc) noexcept {
  return guarded([&] {
    const Call call(engine);
    if (!call.admitted()) return Status::kBusy;
    if (desc.batches > kMaxBatches || desc.characters > (1u << 31)) return Status::kTooManyInstances;
    reserve_memory(desc, engine);
    forget_rest(engine);  // whether or not memory was replaced
    return Status::kOk;
  });
}

Status remove_batch(Engine& engine, BatchId id) noexcept {
  const Call call(engine);
  if (!call.admitted()) return Status::kBusy;
  if (!has_batch(engine, id)) return Status::kUnknownBatch;
  StoredBatch& slot = *engine.batches[slot_of(id).value - 1];
  forget_rest(engine);
  clear_slot(slot);
  return Status::kOk;
}

Status remove_articulation(Engine& engine, ArticulationId id) noexcept {
  const Call call(engine);
  if (!call.admitted()) return Status::kBusy;
  const std::size_t index = index_of(id.value, engine.articulations);
  if (index == engine.articulations.size()) return Status::kUnknownArticulation;
  StoredArticulation& slot = *engine.articulations[index];
  const auto is_of = [&slot](const Articulation* one) { return one == &slot.articulation; };
  const bool has_batches = std::any_of(engine.batches.begin(), engine.batches.end(),
                                       [&](const auto& batch) { return is_of(batch->batch.articulation); });
  const bool has_levels = std::any_of(engine.articulations.begin(), engine.articulations.end(),
                                      [&](const auto& other) { return is_of(other->articulation.lod.posed); });
  if (has_batches || has_levels) return Status::kArticulationInUse;
  slot.articulation = {};
  slot.link_bounds = {};
  slot.convex_shapes = {};
  slot.fcl_shapes.reset();
  slot.arena.release();
  return Status::kOk;
}

Status compute_boxes(Engine& engine, const BatchInput& input, const Policies& policies, Span<Box> boxes) noexcept try {
  Call call(engine, Access::kReadsOnOneThread);
  if (!call.admitted()) return Status::kBusy;
  const kernel::FloatMode mode;
  if (const Status status = validate_policies(policies); status != Status::kOk) return status;
  if (const Status status = bind_inputs(engine, call, {&input, 1}); status != Status::kOk) return status;
  InstanceBatch& batch = call.batch(input.batch);
  batch.margins = {};
  const std::size_t nodes = batch.articulation->node_count;
  if (!boxes.data || boxes.size < std::uint64_t{nodes} * batch.instance_count) return Status::kBadOutput;
  Worker& worker = (*call.reader().pool)[0];
  PoseScratch& posing = worker.pose;
  const FrameContext frame = call.context(policies, 0);
  for (std::uint32_t tile = 0; tile < tile_count(active_count(batch)); ++tile) {
    const TileInstances instances = instances_of(batch, tile);
    const std::uint32_t live = update_and_flag_tile(
        frame, {&batch, instances, RefitScope::kAllNodes, posing.boxes.data, posing.bounds.data}, posing, worker.stats);
    for (std::uint32_t lane = 0; lane < instances.count; ++lane) {
      Box* to = boxes.data + instances.instance[lane] * nodes;
      for (std::size_t n = 0; n < nodes; ++n) {
        to[n] = box_of(posing, policies.refit, n, lane);
        if (!(live >> lane & 1)) to[n] = {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0, 0, 0}};
      }
    }
  }
  return Status::kOk;
} catch (const std::exception&) { return status_of_exception(); }

Status articulation_info(const Engine& engine, ArticulationId id, ArticulationInfo* out) noexcept {
  const Articulation* articulation = find_articulation(engine, id);
  if (!articulation) return Status::kUnknownArticulation;
  if (!out) return Status::kBadOutput;
  *out = {articulation->link_count, articulation->leaf_count, articulation->node_count, articulation->program.depth,
          static_cast<std::uint32_t>(articulation->ignored_pairs.size)};
  return Status::kOk;
}

Status batch_info(const Engine& engine, BatchId id, BatchInfo* out) noexcept {
  if (!has_batch(engine, id)) return Status::kUnknownBatch;
  if (!out) return Status::kBadOutput;
  const InstanceBatch& batch = engine.batch(id);
  *out = {{}, batch.capacity, batch.kind, is_static(batch)};
  for (std::size_t i = 0; i < engine.articulations.size(); ++i)
    if (&engine.articulations[i]->articulation == batch.articulation)
      out->articulation.value = id_of(i, engine.articulations);
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

std::uint32_t engine_thread_count(const Engine& engine) noexcept { return engine.pool.tasks->worker_count(); }

Isa engine_isa(const Engine& engine) noexcept { return engine.kernels->isa; }

BuildInfo build_info() noexcept { return {fcl_test() != nullptr, has_qhull(), has_tbb()}; }

bool isa_available(Isa isa) noexcept { return kernel::find_kernels(isa) != nullptr; }

}  // namespace cab
