// A call in progress: holds the engine and lets go of it, binds and unbinds its batches.
#include "engine/session/call.h"

#include "engine/broad_phase/crowd_batch.h"
#include "engine/session/static_bodies.h"
#include "kernels/pose_leaves.h"

namespace cab {

Call::Call(Engine& engine) : engine_(engine) {
  const std::lock_guard lock(engine.holders.mutex);
  if (engine.holders.is_changing || engine.holders.reading > 0) return;
  engine.holders.is_changing = true;
  admitted_ = true;
}

Call::~Call() {
  if (!admitted_) return;
  unbind();
  Holders& holders = engine_.holders;
  const std::lock_guard lock(holders.mutex);
  if (reader_) {
    reader_->in_use = false;
    --holders.reading;
  } else {
    holders.is_changing = false;
  }
}

void Call::unbind() {
  for (const auto& slot : batches()) {
    if (!slot->in_use()) continue;
    if (slot->completed.batch.value) slot->completed = {};
    if (reader_) {
      slot->batch = {};
      slot->fcl_shapes = nullptr;
      slot->convex_shapes = nullptr;
    } else {
      static_cast<BoundInput&>(slot->batch) = {};
      slot->batch.instance_count = slot->batch.capacity;
    }
  }
}

void Call::bind(const BatchInput& given, bool by_bounds) {
  const std::size_t index = slot_of(given.batch).value - 1;
  const StoredBatch& stored = *engine_.batches[index];
  StoredBatch& bound = *batches()[index];
  if (reader_) copy_stored(index);
  if (stored.statics) bound.completed = stored.statics->complete(given, by_bounds);
  InstanceBatch& batch = bound.batch;
  const BatchInput& input = stored.statics ? bound.completed : given;
  batch.input = &input;
  batch.active = batch.articulation;
  batch.margins = input.margins;
  batch.instance_count = input.count == kAllInstances ? batch.capacity : input.count;
  batch.link_stride = link_bytes(input.poses);
  batch.instance_stride = instance_bytes(input.poses, batch.articulation->link_count);
}

void Call::copy_stored(std::size_t index) {
  const StoredBatch& stored = *engine_.batches[index];
  StoredBatch& copy = *reader_->batches[index];
  copy.batch = stored.batch;
  copy.fcl_shapes = stored.fcl_shapes;
  copy.convex_shapes = stored.convex_shapes;
}

void Call::store_last_bounds(std::size_t index) {
  const std::lock_guard lock(engine_.bounds_mutex);
  store_crowd_bounds(engine_.crowd, *engine_.batches[index]);
}

Status status_of_exception() noexcept {
  try {
    throw;
  } catch (const BrokenSchedule& broken) { return broken.status; } catch (const std::exception&) {
    return Status::kOutOfMemory;  // also where TBB has no memory for its tasks
  }
}

}  // namespace cab
