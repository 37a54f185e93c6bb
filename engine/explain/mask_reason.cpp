// Why an instance is masked: the checks of the posing kernel, one link and one number after the other.
#include "engine/explain/mask_reason.h"

#include "engine/exact/convex_pair.h"
#include "engine/session/call.h"
#include "engine/session/validate.h"
#include "kernels/float_mode.h"
#include "kernels/pose_leaves.h"

#include <algorithm>
#include <cmath>

namespace cab {
namespace {

// The largest entry of |R^T R - I| of the columns of a matrix.
float off_rotation(const kernel::Vec3<float> (&column)[3]) {
  float most = 0;
  for (int a = 0; a < 3; ++a)
    for (int b = a; b < 3; ++b)
      most = std::max(most, std::fabs(kernel::dot(column[a], column[b]) - (a == b ? 1.0f : 0.0f)));
  return most;
}

float largest(const kernel::Vec3<float>& v) { return kernel::max_component(kernel::abs(v)); }

// Looks for the reason in one instance of a batch that is bound to its input.
class MaskSearch {
 public:
  MaskSearch(const InstanceBatch& batch, std::uint32_t instance)
      : batch_(batch),
        articulation_(posed_articulation(*batch.articulation)),
        instance_(instance),
        coding_(coding_of(batch)),
        orientation_(orientation_of(batch, instance)) {}

  // Numbers that are not finite come before rotations that are not rigid, and these before boxes out of range, as
  // flags do.
  MaskReason reason() {
    if (find_number() || find_rotation() || find_out_of_range()) return out_;
    return {};
  }

 private:
  bool found(InstanceFlag flag, MaskCause cause, std::uint32_t index, float value, float limit) {
    out_.flag = flag;
    out_.cause = cause;
    out_.index = index;
    out_.value = value;
    out_.limit = limit;
    return true;
  }

  // The first of `count` numbers that is a NaN or beyond the range.
  bool find_number_in(const float* from, std::uint32_t count, MaskCause cause) {
    for (std::uint32_t i = 0; i < count; ++i) {
      const bool is_read =
          coding_.format != PoseFormat::kMatrix4x4Columns || cause != MaskCause::kPoseNumber || i % 4 != 3;
      if (is_read && !kernel::number_in_range(from[i]))
        return found(kInstanceNotFinite, cause, i, from[i], kMaxCoordinate);
    }
    return false;
  }

  bool find_number() {
    if (orientation_ && find_number_in(orientation_, 4, MaskCause::kOrientationNumber)) return true;
    for (const PosedLink& posed : articulation_.posed_links) {
      out_.link = posed.link;
      if (find_number_in(pose_of(batch_, instance_, posed.link), pose_floats(coding_.format), MaskCause::kPoseNumber))
        return true;
    }
    return false;
  }

  bool find_length(const float* q, MaskCause cause) {
    const float length_sq = (q[0] * q[0] + q[1] * q[1]) + (q[2] * q[2] + q[3] * q[3]);
    if (length_sq >= kQuaternionSqMin && length_sq <= kQuaternionSqMax) return false;
    return found(kInstanceNotRigid, cause, 0, std::sqrt(length_sq),
                 std::sqrt(length_sq < kQuaternionSqMin ? kQuaternionSqMin : kQuaternionSqMax));
  }

  bool find_scale(float scale) {
    if (scale >= kMinScale && scale <= kMaxScale) return false;
    return found(kInstanceNotRigid, MaskCause::kScale, 0, scale, scale < kMinScale ? kMinScale : kMaxScale);
  }

  bool find_rotation() {
    if (orientation_ && find_length(orientation_, MaskCause::kOrientationLength)) return true;
    if (find_scale(scale_of(batch_, instance_))) return true;
    for (const PosedLink& posed : articulation_.posed_links) {
      const float* const pose = pose_of(batch_, instance_, posed.link);
      out_.link = posed.link;
      if (coding_.format == PoseFormat::kQuaternionTranslation) {
        if (find_length(pose, MaskCause::kQuaternionLength)) return true;
        continue;
      }
      const int step = coding_.format == PoseFormat::kMatrix3x4Rows ? 1 : 4,
                down = coding_.format == PoseFormat::kMatrix3x4Rows ? 4 : 1;
      kernel::Vec3<float> column[3];
      for (int k = 0; k < 3; ++k) column[k] = {pose[k * step], pose[k * step + down], pose[k * step + 2 * down]};
      if (coding_.scaling == Scaling::kInMatrices) {
        const float scale = kernel::sqrt(kernel::dot(column[0], column[0]));
        if (find_scale(scale)) return true;
        for (kernel::Vec3<float>& one : column) one = (1.0f / scale) * one;
      }
      if (!kernel::is_rigid(column))
        return found(kInstanceNotRigid, MaskCause::kMatrix, 0, off_rotation(column), kRigidTolerance);
    }
    return false;
  }

  // The pose of a link as the caller gave it, neither rotated nor scaled with its instance.
  kernel::RigidLanes<float> given_pose(std::uint32_t link) const {
    StoredPose at = stored_pose(batch_, instance_, link);
    at.orientation = nullptr;
    if (at.coding.scaling == Scaling::kPerInstance) at.coding.scaling = Scaling::kNone;
    kernel::LaneChecks<float> checks = {true, true, true};
    return placed_pose<float>(at, checks);
  }

  // A leaf's box in its link's frame, with room for what other links do to its vertices.
  kernel::BoxLanes<float> local_box(std::uint32_t link, std::uint32_t leaf) const {
    const Box& local = leaf_box_of(batch_, instance_, leaf);
    kernel::BoxLanes<float> out = kernel::spread_box<float>(local);
    const SkinnedLeaves& skin = articulation_.skin;
    if (skin.empty() || skin.influence_begin[leaf] == skin.influence_begin[leaf + 1]) return out;
    const std::uint32_t begin = skin.influence_begin[leaf];
    const kernel::RigidLanes<float> base = given_pose(link);
    const kernel::GrownLanes<float> grown =
        kernel::grow_box<float>(local, {skin.influences.data + begin, skin.influence_begin[leaf + 1] - begin},
                                skin.own[leaf], [&](std::uint32_t relative) {
                                  const std::uint32_t at = skin.relative_begin[link] + relative;
                                  return kernel::relative_pose(base, given_pose(skin.relatives[at]));
                                });
    out.center = grown.center;
    out.half = grown.half;
    return out;
  }

  bool find_out_of_range() {
    const kernel::LaneChecks<float> all = {true, true, true};
    const PosePad pad = kernel::pad_of(orientation_ != nullptr, 1);
    for (const PosedLink& posed : articulation_.posed_links) {
      kernel::LaneChecks<float> checks = all;
      const kernel::RigidLanes<float> pose = placed_pose<float>(stored_pose(batch_, instance_, posed.link), checks);
      out_.link = posed.link;
      const float* const joint = articulation_.link_joint.data + 3 * posed.link;
      const kernel::Vec3<float> at =
          pose.translation +
          kernel::rotate<float>(pose.column, pose.scale * kernel::Vec3<float>{joint[0], joint[1], joint[2]});
      if (posed.needs_joint && !kernel::in_range(at))
        return found(kInstanceNotFinite, MaskCause::kJoint, posed.link, largest(at), kMaxCoordinate);
      for (std::uint32_t i = posed.leaf_begin; i < posed.leaf_end; ++i) {
        const std::uint32_t leaf = articulation_.leaf_order[i];
        const kernel::BoxLanes<float> box = kernel::pose_scaled_boxes(pose, local_box(posed.link, leaf), pad, 0.0f);
        if (!kernel::in_range(box.center) || !kernel::in_range(box.half))
          return found(kInstanceNotFinite, MaskCause::kBox, leaf, std::max(largest(box.center), largest(box.half)),
                       kMaxCoordinate);
      }
    }
    return false;
  }

  const InstanceBatch& batch_;
  const Articulation& articulation_;
  std::uint32_t instance_;
  PoseCoding coding_;
  const float* orientation_;
  MaskReason out_;
};

}  // namespace

MaskReason mask_reason(const InstanceBatch& batch, std::uint32_t instance) {
  return MaskSearch(batch, instance).reason();
}

Status why_masked(Engine& engine, const BatchInput& input, std::uint32_t instance, MaskReason* out) noexcept try {
  Call call(engine, Access::kReadsOnOneThread);
  if (!call.admitted()) return Status::kBusy;
  const kernel::FloatMode mode;
  if (const Status status = bind_inputs(engine, call, {&input, 1}); status != Status::kOk) return status;
  const InstanceBatch& batch = call.batch(input.batch);
  if (!is_active(batch, instance)) return Status::kBadInstance;
  if (!out) return Status::kBadOutput;
  *out = mask_reason(batch, instance);
  return Status::kOk;
} catch (const std::exception&) { return status_of_exception(); }

}  // namespace cab
