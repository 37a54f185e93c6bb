// A call in progress: locks and unlocks the engine, binds and unbinds its batches.
#include "engine/session/call.h"

#include "engine/session/static_bodies.h"
#include "kernels/pose_leaves.h"

namespace cab {

Call::Call(Engine& engine) : engine_(engine), admitted_(!engine.busy.test_and_set(std::memory_order_acquire)) {}

Call::~Call() {
  if (!admitted_) return;
  unbind();
  engine_.busy.clear(std::memory_order_release);
}

void Call::unbind() {
  for (const auto& slot : engine_.batches) {
    slot->batch.input = nullptr;
    slot->batch.margins = {};
    slot->batch.instance_count = slot->batch.capacity;
    slot->batch.pairs_between = slot->batch.pairs_within = false;
    slot->batch.skips_within = slot->batch.may_rest = false;
  }
}

void Call::bind(const BatchInput& given, bool by_bounds) {
  InstanceBatch& batch = engine_.batch(given.batch);
  StaticBodies* const statics = engine_.batches[slot_of(given.batch).value - 1]->statics.get();
  const BatchInput& input = statics ? statics->complete(given, by_bounds) : given;
  batch.input = &input;
  batch.active = batch.articulation;
  batch.margins = input.margins;
  batch.instance_count = input.count == kAllInstances ? batch.capacity : input.count;
  batch.link_stride = link_bytes(input.poses);
  batch.instance_stride = instance_bytes(input.poses, batch.articulation->link_count);
}

Status status_of_exception() noexcept {
  try {
    throw;
  } catch (const BrokenSchedule& broken) { return broken.status; } catch (const std::exception&) {
    return Status::kOutOfMemory;  // also where TBB has no memory for its tasks
  }
}

}  // namespace cab
