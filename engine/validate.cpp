#include "engine/validate.h"

#include "kernels/pose_leaves.h"

#include <cmath>
#include <tuple>

namespace cab {
namespace {

bool valid_policies(const Policies& policies) {
  const Span<const PolicyField> table = policy_table();
  for (std::uint32_t row = 0; row < table.size; ++row)
    if (policy_get(policies, row) >= table[row].value_count) return false;
  return true;
}

bool has_input(const FrameJob& job, BatchId batch) {
  for (const BatchInput& input : job.inputs)
    if (input.batch.value == batch.value) return true;
  return false;
}

bool valid_rule(const Engine& engine, const FrameJob& job, const PairRule& rule) {
  if (!has_input(job, rule.a) || !has_input(job, rule.b)) return false;
  const InstanceBatch& a = engine.batches[rule.a.value - 1]->batch;
  const InstanceBatch& b = engine.batches[rule.b.value - 1]->batch;
  if (rule.pairing == Pairing::kWithin) return rule.a.value == rule.b.value;
  if (rule.pairing != Pairing::kBetween || a.kind != b.kind) return false;
  if (a.kind == BatchKind::kCharacters) return true;
  return rule.a.value != rule.b.value &&
         (a.instance_count == b.instance_count || a.instance_count == 1 || b.instance_count == 1);
}

bool same_rule(const PairRule& x, const PairRule& y) {
  if (x.pairing != y.pairing) return false;
  return (x.a.value == y.a.value && x.b.value == y.b.value) || (x.a.value == y.b.value && x.b.value == y.a.value);
}

}  // namespace

Status validate_input(const Engine& engine, const BatchInput& input) {
  if (input.batch.value == 0 || input.batch.value > engine.batches.size()) return Status::kUnknownBatch;
  const InstanceBatch& batch = engine.batches[input.batch.value - 1]->batch;
  const PoseView& poses = input.poses;
  if (!poses.data || poses.format > PoseFormat::kMatrix4x4) return Status::kBadPoses;
  const std::size_t pose_bytes = kernel::pose_float_count(poses.format) * sizeof(float);
  const std::size_t link_stride = poses.link_stride ? poses.link_stride : pose_bytes;
  if (link_stride % 4 || poses.instance_stride % 4 || link_stride < pose_bytes) return Status::kBadPoses;
  if (link_stride > (std::size_t{1} << 32) || poses.instance_stride > (std::size_t{1} << 38)) return Status::kBadPoses;
  const std::size_t span = (batch.articulation->link_count - 1) * link_stride + pose_bytes;
  if (poses.instance_stride && poses.instance_stride < span) return Status::kBadPoses;
  const std::size_t n = batch.instance_count;
  if (!input.origins.empty()) {
    if (!input.origins.data || input.origins.size != 3 * n) return Status::kBadOrigins;
    for (const double value : input.origins)
      if (!std::isfinite(value)) return Status::kBadOrigins;
  }
  if (!input.orientations.empty() && (!input.orientations.data || input.orientations.size != 4 * n))
    return Status::kBadOrientations;
  if (!input.flags.empty() && (!input.flags.data || input.flags.size != n)) return Status::kBadFlags;
  return Status::kOk;
}

Status validate_job(const Engine& engine, const FrameJob& job) {
  if (job.inputs.size && !job.inputs.data) return Status::kUnknownBatch;
  if (job.rules.size && !job.rules.data) return Status::kBadPairRule;
  for (std::size_t i = 0; i < job.inputs.size; ++i) {
    if (const Status status = validate_input(engine, job.inputs[i]); status != Status::kOk) return status;
    for (std::size_t j = 0; j < i; ++j)
      if (job.inputs[j].batch.value == job.inputs[i].batch.value) return Status::kBatchGivenTwice;
  }
  for (std::size_t i = 0; i < job.rules.size; ++i) {
    if (!valid_rule(engine, job, job.rules[i])) return Status::kBadPairRule;
    for (std::size_t j = 0; j < i; ++j)
      if (same_rule(job.rules[i], job.rules[j])) return Status::kPairRuleGivenTwice;
  }
  if (!valid_policies(job.policies)) return Status::kBadPolicy;
  if (job.hits.size && !job.hits.data) return Status::kBadHitBuffer;
  if (!job.contacts.empty()) {
    if (!job.contacts.data || job.contacts.size != job.hits.size) return Status::kBadHitBuffer;
    if (job.policies.exact == Exact::kNone) return Status::kContactsNeedExact;
  }
  return Status::kOk;
}

}  // namespace cab
