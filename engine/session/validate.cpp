// The checks of inputs, policies, rules and output arrays of a call.
#include "engine/session/validate.h"

#include "engine/exact/exact.h"
#include "engine/step/joint_states.h"
#include "kernels/pose_leaves.h"
#include "layout/valid_poses.h"

#include <algorithm>
#include <cmath>
#include <functional>

namespace cab {
namespace {

bool has_input(const Engine& engine, BatchId id) { return has_batch(engine, id) && engine.batch(id).input; }

// Records a valid rule in engine.rule_bits, which has one bit per pairing and two batches, and as many again for rules
// that skip what rests. False if a rule with the same pairing and the same two batches, in either order, was recorded
// before.
bool note_rule(Engine& engine, const PairRule& rule) {
  const std::size_t count = engine.batches.size();
  const std::uint32_t slot_a = slot_of(rule.a).value, slot_b = slot_of(rule.b).value;
  const std::size_t a = std::min(slot_a, slot_b) - 1, b = std::max(slot_a, slot_b) - 1;
  const std::size_t bit = (rule.pairing == Pairing::kWithin ? count * count : 0) + a * count + b;
  const std::uint64_t mask = std::uint64_t{1} << (bit & 63);
  if (engine.rule_bits[bit >> 6] & mask) return false;
  engine.rule_bits[bit >> 6] |= mask;
  const std::size_t skips = bit + 2 * count * count;
  if (rule.resting == Resting::kSkipped) engine.rule_bits[skips >> 6] |= std::uint64_t{1} << (skips & 63);
  return true;
}

// Whether the origins of all instances up to `count`, or of those that are listed, are finite.
bool are_finite(Span<const double> origins, std::size_t count, Span<const std::uint32_t> listed) {
  if (origins.empty()) return true;
  const auto all_finite = [&origins](std::size_t begin, std::size_t end) {
    return std::all_of(origins.data + begin, origins.data + end, [](double value) { return std::isfinite(value); });
  };
  if (listed.empty()) return all_finite(0, 3 * count);
  return std::all_of(listed.begin(), listed.end(), [&all_finite](std::uint32_t instance) {
    return all_finite(3 * std::size_t{instance}, 3 * std::size_t{instance} + 3);
  });
}

// Whether the margins of all given instances are in range.
bool are_margins(const InstanceBatch& batch) {
  for (std::uint32_t place = 0; place < active_count(batch); ++place) {
    const float margin = batch.input->margins[active_instance(batch, place)];
    if (!(margin >= 0 && margin <= kMaxCoordinate)) return false;
  }
  return true;
}

// Whether an input has what only characters and sequences take.
bool has_poses(const BatchInput& input) {
  return input.poses.data || input.origins.size || input.orientations.size || input.scales.size || input.moved.size ||
         input.margins.size || input.bounds.size || input.states.kinematics;
}

// Whether the bounds of all given instances are finite, with upper sides that are not below the lower ones.
bool have_sides(const InstanceBatch& batch) {
  for (std::uint32_t place = 0; place < active_count(batch); ++place) {
    const float* const at = batch.input->bounds.data + 6 * std::size_t{active_instance(batch, place)};
    for (int c = 0; c < 3; ++c)
      if (!(std::fabs(at[c]) <= kMaxCoordinate && at[c] <= at[3 + c] && at[3 + c] <= kMaxCoordinate)) return false;
  }
  return true;
}

// Checks the joint states of an input whose poses are valid, but for the number of their values.
Status validate_states(const BatchInput& input, const InstanceBatch& batch) {
  const KinematicsDesc& kinematics = *input.states.kinematics;
  if (batch.kind != BatchKind::kSequence) return Status::kBadStates;
  if (const Status status = validate_kinematics(kinematics); status != Status::kOk) return status;
  const std::size_t links = batch.articulation->link_count;
  const bool own_poses = input.poses.data == input.states.poses &&
                         input.poses.format == PoseFormat::kQuaternionTranslation &&
                         link_bytes(input.poses) == 7 * sizeof(float) &&
                         instance_bytes(input.poses, batch.articulation->link_count) == 7 * sizeof(float) * links;
  return kinematics.link_parents.size == links && own_poses ? Status::kOk : Status::kBadStates;
}

}  // namespace

bool needs_contacts(const FrameJob& job) { return !job.contacts.empty() || job.min_depth > 0; }

Status validate_input(const Engine& engine, const BatchInput& input, Needs needs) {
  if (!has_batch(engine, input.batch)) return Status::kUnknownBatch;
  const InstanceBatch& batch = engine.batch(input.batch);
  if (is_static(batch)) {
    if (has_poses(input)) return Status::kStaticInput;
    needs = Needs::kNothing;
  }
  const bool needs_poses = needs == Needs::kPoses || needs == Needs::kPosesOfFrame;
  const std::size_t most = batch.capacity, n = input.count == kAllInstances ? most : input.count;
  if (needs_poses && !valid_poses(input.poses, batch.articulation->link_count, n > 0)) return Status::kBadPoses;
  if (n > most) return Status::kBadCount;
  // Whether an array is empty, or has data and `per_instance` entries for each instance. In 64 bits, which hold the
  // products where std::size_t has 32.
  const auto fits = [=](const auto& span, std::uint64_t per_instance) {
    return span.empty() || (span.data && span.size >= per_instance * n && span.size <= per_instance * most);
  };
  if (const StateView& states = input.states; states.kinematics) {
    if (const Status status = validate_states(input, batch); status != Status::kOk) return status;
    const std::uint64_t variables = states.kinematics->variable_count;
    if ((states.values.empty() && n * variables > 0) || !fits(states.values, variables)) return Status::kBadStates;
  }
  const Span<const std::uint32_t> listed = input.instances;
  if (!listed.empty()) {
    const bool ascend = listed.data && std::is_sorted(listed.begin(), listed.end(), std::less_equal<>());
    if (!ascend || listed[listed.size - 1] >= n || batch.kind == BatchKind::kSequence) return Status::kBadInstances;
  }
  const bool is_checked = needs == Needs::kPosesOfFrame && batch.bounded_by == engine.bounds_of_frame;
  if (!fits(input.origins, 3)) return Status::kBadOrigins;
  if (!is_checked && !are_finite(input.origins, n, listed)) return Status::kBadOrigins;
  if (!fits(input.orientations, 4)) return Status::kBadOrientations;
  if (!fits(input.scales, 1) || (!input.scales.empty() && input.poses.has_scale)) return Status::kBadScales;
  if (!fits(input.flags, 1)) return Status::kBadFlags;
  if (!fits(input.layers, 1) || !fits(input.layer_masks, 1)) return Status::kBadLayers;
  if (!fits(input.in_contact, 1)) return Status::kBadInContact;
  if (!fits(input.moved, 1) || (!input.moved.empty() && batch.kind == BatchKind::kSequence)) return Status::kBadMoved;
  if (!fits(input.margins, 1) || (!input.margins.empty() && batch.kind == BatchKind::kSequence))
    return Status::kBadMargins;
  if (!fits(input.bounds, 6) || (needs == Needs::kBounds && input.bounds.empty() && n > 0)) return Status::kBadBounds;
  return Status::kOk;
}

Status bind_input(Engine& engine, Call& call, const BatchInput& input, Needs needs) {
  if (const Status status = validate_input(engine, input, needs); status != Status::kOk) return status;
  const InstanceBatch& batch = call.batch(input.batch);
  if (batch.input) return Status::kBatchGivenTwice;
  call.bind(input, needs == Needs::kBounds);
  if (!input.margins.empty() && !are_margins(batch)) return Status::kBadMargins;
  if (!input.bounds.empty() && !have_sides(batch)) return Status::kBadBounds;
  return Status::kOk;
}

Status bind_inputs(Engine& engine, Call& call, Span<const BatchInput> inputs, Needs needs) {
  if (inputs.size && !inputs.data) return Status::kUnknownBatch;
  for (const BatchInput& input : inputs)
    if (const Status status = bind_input(engine, call, input, needs); status != Status::kOk) return status;
  return Status::kOk;
}

bool is_valid_rule(const Engine& engine, const PairRule& rule) {
  if (!has_input(engine, rule.a) || !has_input(engine, rule.b) || rule.resting > Resting::kSkipped) return false;
  const InstanceBatch &a = engine.batch(rule.a), &b = engine.batch(rule.b);
  if (rule.pairing == Pairing::kWithin) return &a == &b && !is_static(a);
  if (rule.pairing != Pairing::kBetween || a.kind != b.kind) return false;
  if (a.kind == BatchKind::kCharacters) return !(is_static(a) && is_static(b));
  return &a != &b && (a.instance_count == b.instance_count || a.instance_count <= 1 || b.instance_count <= 1);
}

Status validate_policies(const Policies& policies) {
  const Span<const PolicyField> table = policy_table();
  for (std::uint32_t row = 0; row < table.size; ++row)
    if (policy_get(policies, row) >= table[row].value_count) return Status::kBadPolicy;
  if (policies.exact != Exact::kNone && !find_exact_test(policies.exact)) return Status::kExactNotBuilt;
  return Status::kOk;
}

Status validate_job(Engine& engine, const FrameJob& job) {
  if (job.rules.size && !job.rules.data) return Status::kBadPairRule;
  std::fill(engine.rule_bits.begin(), engine.rule_bits.end(), std::uint64_t{0});
  for (const PairRule& rule : job.rules) {
    if (!is_valid_rule(engine, rule)) return Status::kBadPairRule;
    if (!note_rule(engine, rule)) return Status::kPairRuleGivenTwice;
  }
  if (const Status status = validate_policies(job.policies); status != Status::kOk) return status;
  if (job.report > Report::kDistances) return Status::kBadReport;
  if (!(job.margin >= 0 && job.margin <= kMaxCoordinate)) return Status::kBadMargin;
  if (!(job.min_depth >= 0 && std::isfinite(job.min_depth)) || (job.min_depth > 0 && job.report == Report::kInContact))
    return Status::kBadMinDepth;
  if (job.hits.size && !job.hits.data) return Status::kBadHitBuffer;
  const bool distances = job.report == Report::kDistances;
  if (distances && job.contacts.size != job.hits.size) return Status::kBadHitBuffer;
  if (!job.contacts.empty() && (!job.contacts.data || job.contacts.size != job.hits.size)) return Status::kBadHitBuffer;
  if (job.policies.exact == Exact::kNone)
    return distances || needs_contacts(job) ? Status::kContactsNeedExact : Status::kOk;
  const bool takes_skins = job.policies.exact == Exact::kSurface && !distances && !needs_contacts(job);
  for (const BatchInput& input : job.inputs) {
    const Articulation& articulation = *engine.batch(input.batch).articulation;
    if (articulation.lod.posed) return Status::kLodWithoutShapes;
    if (has_skin(articulation) && !takes_skins) return Status::kSkinNotTaken;
  }
  return Status::kOk;
}

Status validate_pairs(const Engine& engine, const Call& call, Span<const Hit> pairs) {
  if (pairs.size && !pairs.data) return Status::kBadPairs;
  const auto is_link = [&](BatchSlot slot, std::uint32_t instance, std::uint32_t link) {
    const BatchId id = {slot.value};
    if (!has_batch(engine, id) || !call.batch(id).input) return false;
    const InstanceBatch& batch = call.batch(id);
    return is_active(batch, instance) && !leaves_of(*batch.articulation, link).empty();
  };
  for (const Hit& pair : pairs) {
    const bool twice =
        pair.batch_a.value == pair.batch_b.value && pair.instance_a == pair.instance_b && pair.link_a == pair.link_b;
    if (twice || !is_link(pair.batch_a, pair.instance_a, pair.link_a) ||
        !is_link(pair.batch_b, pair.instance_b, pair.link_b))
      return Status::kBadPairs;
  }
  return Status::kOk;
}

}  // namespace cab
