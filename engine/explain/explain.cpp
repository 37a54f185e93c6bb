// In words: what is wrong with a job, why an instance is masked, what a frame did. The checks themselves are in
// engine/session/validate.cpp; here is what each was about.
#include "engine/explain/mask_reason.h"
#include "engine/explain/text_writer.h"
#include "engine/session/call.h"
#include "engine/session/validate.h"
#include "kernels/float_mode.h"
#include "kernels/pose_link.h"

#include <cab/kinematics.h>

#include <cmath>
#include <limits>

namespace cab {
namespace {

void write_mask(TextWriter& text, const MaskReason& reason) {
  const auto value = static_cast<double>(reason.value), limit = static_cast<double>(reason.limit);
  const char* const way = reason.value < reason.limit ? "below" : "above";
  switch (reason.cause) {
    case MaskCause::kNone: return text.add("nothing: the instance takes part");
    case MaskCause::kPoseNumber:
      return text.add("number %u of the pose of link %u is %g, not finite or above %g", reason.index, reason.link,
                      value, limit);
    case MaskCause::kOrientationNumber:
      return text.add("number %u of the instance's orientation is %g, not finite or above %g", reason.index, value,
                      limit);
    case MaskCause::kQuaternionLength:
      return text.add("the quaternion of link %u has the length %g, %s %g", reason.link, value, way, limit);
    case MaskCause::kOrientationLength:
      return text.add("the instance's orientation has the length %g, %s %g", value, way, limit);
    case MaskCause::kMatrix:
      return text.add("the matrix of link %u is off a rotation by %g, above %g", reason.link, value, limit);
    case MaskCause::kScale: return text.add("the scale of link %u is %g, %s %g", reason.link, value, way, limit);
    case MaskCause::kJoint:
      return text.add("the joint of link %u is posed at %g, above %g", reason.index, value, limit);
    case MaskCause::kBox:
      return text.add("the box of leaf %u on link %u reaches %g, above %g", reason.index, reason.link, value, limit);
  }
  text.add("unknown cause");
}

// What is wrong with a job whose inputs are bound one after the other.
class JobSearch {
 public:
  JobSearch(Engine& engine, const FrameJob& job, Call& call, TextWriter& text)
      : engine_(engine), job_(job), call_(call), text_(text) {}

  void run() {
    if (find_in_inputs()) return;
    if (const Status status = validate_job(engine_, job_); status != Status::kOk)
      find_in_job(status);
    else
      write_remarks();
  }

 private:
  // ------------------------------------------------------------------------------------------------------- inputs

  bool find_in_inputs() {
    if (job_.inputs.size && !job_.inputs.data) {
      text_.add("inputs has %zu entries and no data", job_.inputs.size);
      return true;
    }
    for (std::size_t i = 0; i < job_.inputs.size; ++i) {
      const Status status = bind_input(engine_, call_, job_.inputs[i], Needs::kPoses);
      if (status == Status::kOk) continue;
      text_.add("inputs[%zu]", i);
      describe_input(status, job_.inputs[i]);
      text_.add(": %s", to_string(status));
      return true;
    }
    return false;
  }

  void describe_input(Status status, const BatchInput& input) {
    if (status == Status::kUnknownBatch) return describe_id(input.batch);
    const InstanceBatch& batch = engine_.batch(input.batch);
    const std::size_t n = input.count == kAllInstances ? batch.capacity : input.count;
    switch (status) {
      case Status::kBatchGivenTwice: {
        std::size_t first = 0;
        while (slot_of(job_.inputs[first].batch).value != slot_of(input.batch).value) ++first;
        return text_.add(".batch is that of inputs[%zu] too", first);
      }
      case Status::kStaticInput: return text_.add(" is of static bodies and has more than a batch and layers");
      case Status::kBadPoses: return describe_poses(input.poses, batch.articulation->link_count, n);
      case Status::kBadStates: return describe_states(input, batch, n);
      case Status::kBadCount: return text_.add(".count is %u of %u", input.count, batch.capacity);
      case Status::kBadInstances: return describe_instances(batch, input.instances, n);
      case Status::kBadOrigins:
        if (has_size(".origins", input.origins, 3, n, batch)) name_number(".origins", input.origins, 3, input, n);
        return;
      case Status::kBadOrientations: return void(has_size(".orientations", input.orientations, 4, n, batch));
      case Status::kBadScales:
        if (has_size(".scales", input.scales, 1, n, batch)) text_.add(".scales is given, and poses.has_scale is set");
        return;
      case Status::kBadFlags: return void(has_size(".flags", input.flags, 1, n, batch));
      case Status::kBadLayers:
        if (has_size(".layers", input.layers, 1, n, batch)) has_size(".layer_masks", input.layer_masks, 1, n, batch);
        return;
      case Status::kBadInContact: return void(has_size(".in_contact", input.in_contact, 1, n, batch));
      case Status::kBadMoved:
        if (has_size(".moved", input.moved, 1, n, batch)) text_.add(".moved is given for a sequence");
        return;
      case Status::kBadMargins:
        if (!has_size(".margins", input.margins, 1, n, batch)) return;
        if (batch.kind == BatchKind::kSequence) return text_.add(".margins is given for a sequence");
        return name_number(".margins", input.margins, 1, input, n);
      case Status::kBadBounds:
        if (has_size(".bounds", input.bounds, 6, n, batch)) name_number(".bounds", input.bounds, 6, input, n);
        return;
      case Status::kNoLinks:
      case Status::kTooManyLinks:
      case Status::kBadParent:
      case Status::kBadJoint: return text_.add(".states.kinematics is refused: %s", to_string(status));
      default: return;
    }
  }

  void describe_id(BatchId id) {
    const std::size_t slot = slot_of(id).value;
    if (id.value == 0) return text_.add(".batch is 0, the id of nothing");
    if (slot == 0 || slot > engine_.batches.size())
      return text_.add(".batch names slot %zu of %zu", slot, engine_.batches.size());
    if (!engine_.batches[slot - 1]->in_use()) return text_.add(".batch names slot %zu, which is empty", slot);
    text_.add(".batch names what was in slot %zu before, or is of another engine", slot);
  }

  void describe_poses(const PoseView& poses, std::size_t link_count, std::size_t n) {
    if (poses.format > PoseFormat::kMatrix4x4Columns)
      return text_.add(".poses.format is %u", static_cast<unsigned>(poses.format));
    if (poses.has_scale && poses.format == PoseFormat::kQuaternionTranslation)
      return text_.add(".poses.has_scale is set with quaternions");
    const std::size_t pose_bytes = pose_floats(poses.format) * sizeof(float);
    const std::size_t link_stride = poses.link_stride ? poses.link_stride : pose_bytes;
    if (link_stride % 4 || link_stride < pose_bytes || std::uint64_t{link_stride} > std::uint64_t{1} << 32)
      return text_.add(".poses.link_stride is %zu, for poses of %zu bytes", link_stride, pose_bytes);
    if (!poses.data && n > 0) return text_.add(".poses.data is null");
    text_.add(".poses.instance_stride is %zu, for %zu links of %zu bytes", poses.instance_stride, link_count,
              link_stride);
  }

  void describe_states(const BatchInput& input, const InstanceBatch& batch, std::size_t n) {
    const StateView& states = input.states;
    const std::size_t links = states.kinematics->link_parents.size;
    const std::uint64_t variables = states.kinematics->variable_count, least = n * variables;
    if (batch.kind != BatchKind::kSequence) return text_.add(".states is given for characters");
    if (links != batch.articulation->link_count)
      return text_.add(".states.kinematics has %zu links, the batch %u", links, batch.articulation->link_count);
    if (states.values.size < least || states.values.size > batch.capacity * variables || (least && !states.values.data))
      return text_.add(".states.values has %zu numbers, not %.0f", states.values.data ? states.values.size : 0,
                       static_cast<double>(least));
    text_.add(".states.poses is not what .poses names, as quaternions and translations without gaps");
  }

  void describe_instances(const InstanceBatch& batch, Span<const std::uint32_t> listed, std::size_t n) {
    if (batch.kind == BatchKind::kSequence) return text_.add(".instances is given for a sequence");
    if (!listed.data) return text_.add(".instances has %zu entries and no data", listed.size);
    for (std::size_t i = 0; i < listed.size; ++i) {
      if (listed[i] >= n) return text_.add(".instances[%zu] is %u, of %zu instances", i, listed[i], n);
      if (i && listed[i] <= listed[i - 1])
        return text_.add(".instances[%zu] is %u, after %u", i, listed[i], listed[i - 1]);
    }
  }

  // Whether an array that is given has data and entries for all instances; if not, it says so.
  template <class T>
  bool has_size(const char* name, Span<T> array, std::size_t per_instance, std::size_t n, const InstanceBatch& batch) {
    if (array.empty()) return true;
    if (!array.data) {
      text_.add("%s has %zu values and no data", name, array.size);
      return false;
    }
    if (array.size >= per_instance * n && array.size <= per_instance * batch.capacity) return true;
    text_.add("%s has %zu values for %zu instances of a batch of %u", name, array.size, n, batch.capacity);
    return false;
  }

  // Names the first number of the given instances that is not in range, or below the one three places before it.
  template <class T>
  void name_number(const char* name, Span<const T> array, std::size_t per_instance, const BatchInput& input,
                   std::size_t n) {
    const auto most = per_instance == 3 ? std::numeric_limits<T>::max() : static_cast<T>(kMaxCoordinate);
    const bool is_bounds = per_instance == 6;
    // The input is refused, so it is not bound to its batch.
    const Span<const std::uint32_t> listed = input.instances;
    for (std::size_t place = 0; place < (listed.empty() ? n : listed.size); ++place)
      for (std::size_t k = 0; k < per_instance; ++k) {
        const std::size_t i = per_instance * (listed.empty() ? place : listed[place]) + k;
        const bool out_of_range = !(std::fabs(array[i]) <= most) || (per_instance == 1 && array[i] < 0);
        if (out_of_range || (is_bounds && k >= 3 && array[i] < array[i - 3]))
          return text_.add("%s[%zu] is %g", name, i, static_cast<double>(array[i]));
      }
  }

  // ---------------------------------------------------------------------------------------------------------- job

  void find_in_job(Status status) {
    switch (status) {
      case Status::kBadPairRule: describe_rule(); break;
      case Status::kPairRuleGivenTwice: describe_rule_given_twice(); break;
      case Status::kBadPolicy: describe_policy(); break;
      case Status::kExactNotBuilt: text_.add("policies.exact is fcl"); break;
      case Status::kBadReport: text_.add("report is %u", static_cast<unsigned>(job_.report)); break;
      case Status::kBadMargin: text_.add("margin is %g", static_cast<double>(job_.margin)); break;
      case Status::kBadMinDepth: text_.add("min_depth is %g", static_cast<double>(job_.min_depth)); break;
      case Status::kBadHitBuffer:
        text_.add("hits has room for %zu and %s, contacts for %zu and %s", job_.hits.size,
                  job_.hits.data ? "data" : "no data", job_.contacts.size, job_.contacts.data ? "data" : "no data");
        break;
      case Status::kContactsNeedExact: text_.add("policies.exact is none"); break;
      case Status::kLodWithoutShapes:
        for (std::size_t i = 0; i < job_.inputs.size; ++i)
          if (engine_.batch(job_.inputs[i].batch).articulation->lod.posed) {
            text_.add("inputs[%zu] is of a level of nodes", i);
            break;
          }
        break;
      case Status::kSkinNotTaken:
        for (std::size_t i = 0; i < job_.inputs.size; ++i)
          if (has_skin(*engine_.batch(job_.inputs[i].batch).articulation)) {
            text_.add("inputs[%zu] is of an articulation with a skin", i);
            break;
          }
        break;
      default: text_.add("the job"); break;
    }
    text_.add(": %s", to_string(status));
  }

  bool has_input(BatchId id) const { return has_batch(engine_, id) && engine_.batch(id).input; }

  void describe_rule() {
    if (!job_.rules.data) return text_.add("rules has %zu entries and no data", job_.rules.size);
    std::size_t i = 0;
    while (is_valid_rule(engine_, job_.rules[i])) ++i;
    const PairRule& rule = job_.rules[i];
    text_.add("rules[%zu]", i);
    if (!has_input(rule.a)) return text_.add(".a is of no input");
    if (!has_input(rule.b)) return text_.add(".b is of no input");
    if (rule.resting > Resting::kSkipped) return text_.add(".resting is %u", static_cast<unsigned>(rule.resting));
    if (rule.pairing > Pairing::kWithin) return text_.add(".pairing is %u", static_cast<unsigned>(rule.pairing));
    const InstanceBatch &a = engine_.batch(rule.a), &b = engine_.batch(rule.b);
    if (rule.pairing == Pairing::kWithin)
      return text_.add(&a == &b ? " pairs static bodies within" : " pairs two batches within");
    if (a.kind != b.kind) return text_.add(" pairs characters with a sequence");
    if (a.kind == BatchKind::kCharacters) return text_.add(" pairs static bodies with each other");
    if (&a == &b) return text_.add(" pairs a sequence with itself");
    text_.add(" pairs sequences of %u and %u frames", a.instance_count, b.instance_count);
  }

  void describe_rule_given_twice() {
    const auto same = [](const PairRule& x, const PairRule& y) {
      const std::uint32_t xa = slot_of(x.a).value, xb = slot_of(x.b).value, ya = slot_of(y.a).value,
                          yb = slot_of(y.b).value;
      return x.pairing == y.pairing && ((xa == ya && xb == yb) || (xa == yb && xb == ya));
    };
    for (std::size_t i = 1; i < job_.rules.size; ++i)
      for (std::size_t k = 0; k < i; ++k)
        if (same(job_.rules[i], job_.rules[k])) return text_.add("rules[%zu] and rules[%zu] pair the same", k, i);
  }

  void describe_policy() {
    const Span<const PolicyField> table = policy_table();
    for (std::uint32_t row = 0; row < table.size; ++row)
      if (const std::uint32_t value = policy_get(job_.policies, row); value >= table[row].value_count)
        return text_.add("policies.%s is %u", table[row].name, value);
  }

  // ------------------------------------------------------------------------------------- what may not be meant

  // Begins a remark on a line of its own.
  void begin_remark() {
    if (text_.length()) text_.add("\n");
  }

  void write_remarks() {
    if (job_.inputs.empty()) {
      begin_remark();
      text_.add("inputs is empty: no batch takes part");
    }
    if (job_.rules.empty()) {
      begin_remark();
      text_.add("rules is empty: nothing is tested against anything");
    }
    // As run_frame left it.
    if (job_.hits_needed > job_.hits.size) {
      begin_remark();
      text_.add("hits has room for %zu of the %zu hits of its last frame: %s", job_.hits.size, job_.hits_needed,
                to_string(Status::kHitsOverflow));
    }
    for (std::size_t i = 0; i < job_.inputs.size; ++i) {
      remark_on_rules(i);
      remark_on_level(i);
      remark_on_masks(i);
    }
    if (text_.length() == 0) text_.add("nothing is wrong");
  }

  void remark_on_rules(std::size_t i) {
    const BatchSlot slot = slot_of(job_.inputs[i].batch);
    for (const PairRule& rule : job_.rules)
      if (slot_of(rule.a).value == slot.value || slot_of(rule.b).value == slot.value) return;
    if (job_.rules.empty()) return;
    begin_remark();
    text_.add("inputs[%zu] is in no rule: its instances are in no pair", i);
  }

  // Characters of so few boxes are tested faster than a level of them (docs/policies.md, Levels of detail).
  void remark_on_level(std::size_t i) {
    constexpr std::uint32_t kFewLeaves = 16;
    const InstanceBatch& batch = engine_.batch(job_.inputs[i].batch);
    const Lod& lod = batch.articulation->lod;
    if (batch.kind != BatchKind::kCharacters || lod.leaf_of_link.empty() || lod.finest_leaves > kFewLeaves) return;
    begin_remark();
    text_.add("inputs[%zu] is of a level of an articulation of %u boxes: with so few boxes no level saves time", i,
              lod.finest_leaves);
  }

  void remark_on_masks(std::size_t i) {
    const InstanceBatch& batch = engine_.batch(job_.inputs[i].batch);
    std::uint32_t masked = 0, first = 0;
    MaskReason reason;
    for (std::uint32_t place = 0; place < active_count(batch); ++place) {
      const std::uint32_t instance = active_instance(batch, place);
      const MaskReason found = mask_reason(batch, instance);
      if (found.cause == MaskCause::kNone) continue;
      if (masked++ == 0) reason = found, first = instance;
    }
    if (masked == 0) return;
    begin_remark();
    text_.add("inputs[%zu]: %u of %u instances are masked, the first is %u: ", i, masked, active_count(batch), first);
    write_mask(text_, reason);
  }

  Engine& engine_;
  const FrameJob& job_;
  Call& call_;
  TextWriter& text_;
};

}  // namespace

std::size_t explain_job(Engine& engine, const FrameJob& job, Span<char> text) noexcept {
  TextWriter writer(text);
  Call call(engine);
  if (!call.admitted()) {
    writer.add("%s", to_string(Status::kBusy));
    return writer.length();
  }
  const kernel::FloatMode mode;
  JobSearch(engine, job, call, writer).run();
  return writer.length();
}

std::size_t explain_mask(const MaskReason& reason, Span<char> text) noexcept {
  TextWriter writer(text);
  write_mask(writer, reason);
  return writer.length();
}

std::size_t stats_line(const FrameStats& stats, Span<char> text) noexcept {
  TextWriter writer(text);
  const auto ms = [](double seconds) { return 1e3 * seconds; };
  const auto count = [](std::uint64_t value) { return static_cast<unsigned long long>(value); };
  writer.add(
      "%.3f ms (update %.3f, broad %.3f, test %.3f, query %.3f): %llu candidates, %llu box tests, "
      "%llu leaf pairs, %llu exact tests, %llu false positives, %llu hits kept, %llu resting, %llu masked",
      ms(stats.seconds_total), ms(stats.seconds_update), ms(stats.seconds_broad), ms(stats.seconds_test),
      ms(stats.seconds_query), count(stats.candidates), count(stats.box_tests), count(stats.leaf_pairs),
      count(stats.exact_tests), count(stats.false_positives), count(stats.hits_kept), count(stats.instances_resting),
      count(stats.instances_masked));
  return writer.length();
}

}  // namespace cab
