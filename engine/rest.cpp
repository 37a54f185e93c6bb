// Which characters rest: compares the settings of a frame with those of the last one.
#include "engine/rest.h"

#include "kernels/pose_leaves.h"

#include <algorithm>
#include <cstring>

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
         same_policies(last.policies, job.policies) && std::equal(rules.begin(), rules.end(), last.rule_bits.begin());
}

// Adds bytes to a checksum (FNV-1a by words of four bytes).
template <class T>
std::uint64_t add_bytes(std::uint64_t sum, const T* from, std::size_t count) {
  static_assert(sizeof(T) % 4 == 0);
  for (std::size_t i = 0; from && i < count * sizeof(T) / 4; ++i) {
    std::uint32_t word;
    std::memcpy(&word, reinterpret_cast<const char*>(from) + 4 * i, 4);
    sum = (sum ^ word) * 0x100000001b3u;
  }
  return sum;
}

template <class T>
std::uint64_t add_entry(std::uint64_t sum, Span<const T> all, std::uint32_t instance, std::size_t per_instance) {
  return all.empty() ? sum * 3 : add_bytes(sum, all.data + per_instance * instance, per_instance);
}

// The checksum of what must not change while an instance rests.
std::uint64_t checksum_of(const InstanceBatch& batch, std::uint32_t instance) {
  const BatchInput& input = *batch.input;
  std::uint64_t sum = 0xcbf29ce484222325u;
  const std::size_t floats = pose_floats(input.poses.format);
  for (std::uint32_t link = 0; link < batch.articulation->link_count; ++link)
    sum = add_bytes(sum, pose_of(batch, instance, link), floats);
  sum = add_entry(sum, input.origins, instance, 3);
  sum = add_entry(sum, input.orientations, instance, 4);
  sum = add_entry(sum, input.scales, instance, 1);
  sum = add_entry(sum, input.margins, instance, 1);
  for (const Span<const std::uint32_t> words : {input.layers, input.layer_masks}) {
    const std::uint32_t word = words.empty() ? ~0u : words[instance];  // all bits, whether they are given or not
    sum = add_bytes(sum, &word, 1);
  }
  return sum;
}

// Whether every instance that rests is what it was in the last frame. Stores the checksums of all instances.
bool check_rest(InstanceBatch& batch) {
  bool same = true;
  for (std::uint32_t place = 0; place < given_count(batch); ++place) {
    const std::uint32_t instance = given_instance(batch, place);
    const std::uint64_t sum = checksum_of(batch, instance);
    same = same && (!goes_on_resting(batch, instance) || sum == batch.checksums[instance]);
    batch.checksums[instance] = sum;
  }
  return same;
}

void clear_rest(InstanceBatch& batch) {
  if (batch.has_rest) std::fill(batch.rest.begin(), batch.rest.end(), std::uint8_t{0});
  batch.has_rest = false;
}

}  // namespace

Status begin_rest(Engine& engine, const FrameJob& job) {
  RestState& state = engine.rest;
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
  std::copy(engine.rule_bits.begin(), engine.rule_bits.end(), state.rule_bits.begin());
  bool same = true;
  for (const BatchInput& input : job.inputs) {
    InstanceBatch& batch = engine.batch(input.batch);
    if (batch.kind != BatchKind::kCharacters) continue;
    if (StaticBodies* const statics = engine.batches[slot_of(input.batch).value - 1]->statics.get())
      statics->note_layers(batch);
    batch.may_rest = !batch.input->moved.empty() && batch.rest_epoch == state.epoch;
    batch.rest_epoch = 0;
    if (kChecksRest) same = check_rest(batch) && same;
    if (batch.may_rest)
      batch.has_rest = true;
    else
      clear_rest(batch);
  }
  if (same) return Status::kOk;
  forget_rest(engine);
  return Status::kMovedAtRest;
}

void end_rest(Engine& engine, const FrameJob& job) {
  if (!engine.rest.known) return;
  for (const BatchInput& input : job.inputs) engine.batch(input.batch).rest_epoch = engine.rest.epoch;
}

void forget_rest(Engine& engine) {
  ++engine.rest.epoch;
  engine.rest.known = false;
  engine.broad_phase.kept.count = 0;
  engine.hit_store.holds_last = false;
  for (const auto& slot : engine.batches) clear_rest(slot->batch);
}

}  // namespace cab
