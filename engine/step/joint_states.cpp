#include "engine/step/joint_states.h"

#include "kernels/link_poses.h"

#include <algorithm>
#include <cmath>

namespace cab {
namespace {

bool are_finite(const double* values, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i)
    if (!std::isfinite(values[i])) return false;
  return true;
}

// Whether a vector is of length 1, to 1e-6.
template <std::size_t kSize>
bool is_unit(const double (&v)[kSize]) {
  double square = 0;
  for (const double x : v) square += x * x;
  return std::fabs(square - 1) <= 2e-6;
}

bool is_valid(const JointDesc& joint, std::uint32_t variable_count) {
  const std::uint32_t variables = joint.kind == JointKind::kBall ? 3 : 1;
  return joint.kind <= JointKind::kBall && variable_count >= variables &&
         joint.variable <= variable_count - variables && (joint.kind == JointKind::kBall || is_unit(joint.axis)) &&
         are_finite(joint.anchor, 3) && std::isfinite(joint.multiplier) && std::isfinite(joint.offset);
}

}  // namespace

Status validate_kinematics(const KinematicsDesc& desc) {
  const std::size_t count = desc.link_parents.size;
  if (count == 0) return Status::kNoLinks;
  if (count > kMaxLinks) return Status::kTooManyLinks;
  if (!desc.link_parents.data) return Status::kBadParent;
  for (std::size_t l = 0; l < count; ++l)
    if (desc.link_parents[l] < -1 || desc.link_parents[l] >= static_cast<std::int32_t>(l)) return Status::kBadParent;
  if (desc.links.size != count || !desc.links.data || (desc.joints.size && !desc.joints.data)) return Status::kBadJoint;
  std::size_t joints = 0;
  for (const LinkPlaceDesc& link : desc.links) {
    if (!is_unit(link.rotation) || !are_finite(link.translation, 3)) return Status::kBadJoint;
    joints += link.joint_count;
  }
  if (joints != desc.joints.size) return Status::kBadJoint;
  for (const JointDesc& joint : desc.joints)
    if (!is_valid(joint, desc.variable_count)) return Status::kBadJoint;
  return Status::kOk;
}

void pose_states(const FrameContext& frame, const InstanceBatch& batch, std::uint32_t tile, PoseScratch& scratch) {
  const StateView& states = batch.input->states;
  const std::uint32_t first = tile * kLanes;
  frame.kernels.pose_states(
      {*states.kinematics, states.values.data + std::size_t{first} * states.kinematics->variable_count,
       std::min(kLanes, batch.instance_count - first), scratch.states.data, scratch.state_poses.data,
       scratch.links.data, states.poses + std::size_t{first} * 7 * batch.articulation->link_count});
}

}  // namespace cab
