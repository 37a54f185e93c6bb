// Which characters rest: compares the settings of a frame with those of the last one.
#include "engine/session/rest.h"

#include "engine/broad_phase/strips.h"
#include "engine/session/static_bodies.h"
#include "engine/step/live_instances.h"
#include "kernels/pose_leaves.h"

#include <algorithm>
#include <cstring>
#include <utility>

namespace cab {
namespace {

bool same_policies(const Policies& x, const Policies& y) {
  for (std::uint32_t field = 0; field < policy_table().size; ++field)
    if (policy_get(x, field) != policy_get(y, field)) return false;
  return true;
}

// Whether all but the instances is as in the last frame.
bool same_settings(const RestState& last, const FrameJob& job, Span<const std::uint64_t> rules) {
  return last.known && last.margin == job.margin && last.min_depth == job.min_depth && last.report == job.report &&
         last.containment == job.containment && same_policies(last.policies, job.policies) &&
         std::equal(rules.begin(), rules.end(), last.rule_bits.begin());
}

// Adds numbers to a checksum (FNV-1a by words of four bytes). The sign of a zero does not count.
template <class T>
std::uint64_t add_numbers(std::uint64_t sum, const T* from, std::size_t count) {
  static_assert(sizeof(T) % 4 == 0);
  for (std::size_t i = 0; i < count; ++i) {
    const T number = from[i] + T{0};
    std::uint32_t words[sizeof(T) / 4];
    std::memcpy(words, &number, sizeof number);
    for (const std::uint32_t word : words) sum = (sum ^ word) * 0x100000001b3u;
  }
  return sum;
}

// Adds the numbers of an instance, or those that stand for an empty span.
template <class T, std::size_t kCount>
std::uint64_t add_entry(std::uint64_t sum, Span<const T> all, std::uint32_t instance, const T (&if_empty)[kCount]) {
  return add_numbers(sum, all.empty() ? if_empty : all.data + kCount * instance, kCount);
}

// Adds a pose, matrices of both formats by rows. The last row of a 4x4 matrix is never read.
std::uint64_t add_pose(std::uint64_t sum, PoseFormat format, const float* pose) {
  if (format != PoseFormat::kMatrix4x4Columns) return add_numbers(sum, pose, pose_floats(format));
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column) sum = add_numbers(sum, pose + 4 * column + row, 1);
  return sum;
}

// The checksum of what must not change while an instance rests: of all that a frame reads of it.
std::uint64_t checksum_of(const InstanceBatch& batch, std::uint32_t instance) {
  const BatchInput& input = *batch.input;
  std::uint64_t sum = 0xcbf29ce484222325u;
  for (const PosedLink& posed : posed_articulation(*batch.articulation).posed_links)
    sum = add_pose(sum, input.poses.format, pose_of(batch, instance, posed.link));
  sum = add_entry(sum, input.origins, instance, {0.0, 0.0, 0.0});
  sum = add_entry(sum, input.orientations, instance, {0.0f, 0.0f, 0.0f, 1.0f});
  sum = add_entry(sum, input.scales, instance, {1.0f});
  sum = add_entry(sum, input.margins, instance, {0.0f});
  sum = add_entry(sum, input.layers, instance, {~std::uint32_t{0}});
  return add_entry(sum, input.layer_masks, instance, {~std::uint32_t{0}});
}

// Whether every instance that rests is what it was in the last frame. Stores the checksums of all instances.
bool check_rest(InstanceBatch& batch) {
  bool same = true;
  for (std::uint32_t place = 0; place < active_count(batch); ++place) {
    const std::uint32_t instance = active_instance(batch, place);
    const std::uint64_t sum = checksum_of(batch, instance);
    same = same && (!still_resting(batch, instance) || sum == batch.checksums[instance]);
    batch.checksums[instance] = sum;
  }
  return same;
}

void clear_rest(InstanceBatch& batch) {
  if (batch.has_rest) std::fill(batch.rest.begin(), batch.rest.end(), std::uint8_t{0});
  batch.has_rest = false;
}

}  // namespace

Status note_answer(Engine& engine, Status status) {
  if (status != Status::kOk) engine.frames_failed.fetch_add(1, std::memory_order_relaxed);
  return status;
}

Status begin_rest(Engine& engine, const FrameJob& job, std::uint64_t failed_before) {
  RestState& state = engine.rest;
  if (std::exchange(state.failed_before, failed_before) != failed_before) forget_rest(engine);
  const bool asked = std::any_of(job.inputs.begin(), job.inputs.end(), [&engine](const BatchInput& input) {
    return !engine.batch(input.batch).input->moved.empty();
  });
  if (!asked || !same_settings(state, job, {engine.rule_bits.data, engine.rule_bits.size})) forget_rest(engine);
  if (!asked) return Status::kOk;
  state.known = true;
  state.policies = job.policies;
  state.margin = job.margin;
  state.min_depth = job.min_depth;
  state.report = job.report;
  state.containment = job.containment;
  std::copy(engine.rule_bits.begin(), engine.rule_bits.end(), state.rule_bits.begin());
  bool same = true;
  for (const BatchInput& input : job.inputs) {
    InstanceBatch& batch = engine.batch(input.batch);
    if (batch.kind != BatchKind::kCharacters) continue;
    if (StaticBodies* const statics = engine.batches[slot_of(input.batch).value - 1]->statics.get())
      statics->note_layers(batch);
    const bool rotated = !batch.input->orientations.empty(), was_rotated = std::exchange(batch.was_rotated, rotated);
    batch.may_rest = !batch.input->moved.empty() && batch.rest_epoch == state.epoch && rotated == was_rotated;
    batch.rest_epoch = 0;
    if (kChecksRest) same = check_rest(batch) && same;
    if (batch.may_rest)
      batch.has_rest = true;
    else
      clear_rest(batch);
  }
  return same ? Status::kOk : Status::kMovedAtRest;
}

void end_rest(Engine& engine, const FrameJob& job) {
  if (!engine.rest.known) return;
  for (const BatchInput& input : job.inputs) engine.batch(input.batch).rest_epoch = engine.rest.epoch;
}

void forget_rest(Engine& engine) {
  ++engine.rest.epoch;
  engine.rest.known = false;
  clear_kept(engine.crowd);
  engine.hit_store.holds_last = false;
  for (const auto& slot : engine.batches) clear_rest(slot->batch);
}

}  // namespace cab
