// Coarser levels of articulations: where joints are in the caller's poses, and the calls.
#include "layout/lod.h"
#include "engine/exact/convex_pair.h"
#include "engine/session/call.h"
#include "engine/session/slots.h"
#include "engine/session/validate.h"
#include "kernels/float_mode.h"
#include "layout/valid_poses.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace cab {
namespace {

using Point = std::array<double, 3>;

double dot(const Double3& v, const Point& p) { return v.x * p[0] + v.y * p[1] + v.z * p[2]; }
Point point(const Double3& v) { return {v.x, v.y, v.z}; }

// The middle of points, and how far they are from there.
class Middle {
 public:
  void add(const Point& p, double rounding) {
    for (std::size_t c = 0; c < 3; ++c) {
      lo_[c] = std::min(lo_[c], p[c]);
      hi_[c] = std::max(hi_[c], p[c]);
    }
    rounding_ = std::max(rounding_, rounding);
  }

  JointPlace place() const {
    JointPlace out;
    double square = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      out.at[c] = 0.5 * (lo_[c] + hi_[c]);
      square += 0.25 * (hi_[c] - lo_[c]) * (hi_[c] - lo_[c]);
    }
    out.play = std::sqrt(square) + rounding_;
    return out;
  }

 private:
  static constexpr double kFar = std::numeric_limits<double>::infinity();
  Point lo_ = {kFar, kFar, kFar}, hi_ = {-kFar, -kFar, -kFar};
  double rounding_ = 0;
};

// The poses of all links of one instance, in double. False if one of them is no valid pose.
bool read_poses(const PoseView& poses, const float* first, std::vector<kernel::RigidLanes<double>>& out) {
  const std::size_t stride = link_bytes(poses) / sizeof(float);
  for (std::size_t link = 0; link < out.size(); ++link) {
    const StoredPose stored = {coding_of(poses), first + link * stride, nullptr, 1};
    if (!is_valid(stored)) return false;
    out[link] = pose_in_double(stored);
  }
  return true;
}

// By link where its joint is in the frame of its parent, over all rest poses.
Status find_joints(const Articulation& articulation, const LodDesc& desc, std::vector<JointPlace>& out) {
  const PoseView& poses = desc.rest_poses;
  if (desc.rest_pose_count == 0 || !valid_poses(poses, articulation.link_count)) return Status::kBadRestPose;
  std::vector<kernel::RigidLanes<double>> pose(articulation.link_count);
  std::vector<Middle> joints(articulation.link_count);
  const std::size_t stride = instance_bytes(poses, articulation.link_count);
  for (std::uint32_t i = 0; i < desc.rest_pose_count; ++i) {
    if (!read_poses(poses, poses.data + i * (stride / sizeof(float)), pose)) return Status::kBadRestPose;
    for (std::uint32_t link = 0; link < articulation.link_count; ++link) {
      if (articulation.link_parent[link] < 0) continue;
      const auto &own = pose[link], &parent = pose[static_cast<std::size_t>(articulation.link_parent[link])];
      const float* const j = articulation.link_joint.data + 3 * link;
      const Double3 joint =
          own.scale * Double3{static_cast<double>(j[0]), static_cast<double>(j[1]), static_cast<double>(j[2])};
      const Double3 at = own.translation + kernel::rotate<double>(own.column, joint);
      const Point from_parent = point(at - parent.translation);
      const double size = std::sqrt(kernel::dot(at, at)) + std::sqrt(kernel::dot(joint, joint)) +
                          std::sqrt(kernel::dot(parent.translation, parent.translation));
      joints[link].add(
          {dot(parent.column[0], from_parent) / parent.scale, dot(parent.column[1], from_parent) / parent.scale,
           dot(parent.column[2], from_parent) / parent.scale},
          kReachRounding * size / parent.scale);
    }
  }
  out.resize(articulation.link_count);
  for (std::uint32_t link = 0; link < articulation.link_count; ++link) {
    if (articulation.link_parent[link] < 0) continue;
    out[link] = joints[link].place();
    out[link].play += static_cast<double>(desc.joint_play);
  }
  return Status::kOk;
}

// Builds the level that desc asks for.
Status build(const Articulation& fine, const LodDesc& desc, StoredArticulation& to, std::uint32_t* bad_leaf) {
  if (fine.lod.leaf_of_link.size || desc.kind > LodKind::kNodes) return Status::kBadLod;
  if (desc.kind == LodKind::kNodes) {
    if (desc.leaves.size) return Status::kBadLod;
    return build_node_lod(fine, desc.max_leaves, to.arena, &to.articulation);
  }
  if (!(desc.joint_play >= 0 && desc.joint_play <= kMaxCoordinate)) return Status::kBadLod;
  std::vector<JointPlace> joints;
  if (const Status status = find_joints(fine, desc, joints); status != Status::kOk) return status;
  return build_reach_lod(fine, desc, joints, to.arena, &to.articulation, bad_leaf);
}

}  // namespace

Status add_lod(Engine& engine, const LodDesc& desc, ArticulationId* out, std::uint32_t* bad_leaf) noexcept {
  return guarded([&] {
    const Call call(engine);
    if (!call.admitted()) return Status::kBusy;
    if (!out) return Status::kBadOutput;
    const kernel::FloatMode mode;
    const Articulation* const fine = find_articulation(engine, desc.of);
    if (!fine) return Status::kUnknownArticulation;
    if (has_skin(*fine) && desc.kind == LodKind::kReach) return Status::kSkinNotTaken;
    auto slot = std::make_unique<StoredArticulation>(engine.allocator);
    if (const Status status = build(*fine, desc, *slot, bad_leaf); status != Status::kOk) return status;
    store_articulation(std::move(slot), engine, out);
    return Status::kOk;
  });
}

Status lod_leaves(const Engine& engine, ArticulationId level, Span<std::uint16_t> leaf_of_link) noexcept {
  const Articulation* const articulation = find_articulation(engine, level);
  if (!articulation) return Status::kUnknownArticulation;
  const Span<const std::uint16_t> leaves = articulation->lod.leaf_of_link;
  if (leaves.empty()) return Status::kBadLod;
  if (leaf_of_link.size < leaves.size || !leaf_of_link.data) return Status::kBadOutput;
  std::copy(leaves.begin(), leaves.end(), leaf_of_link.data);
  return Status::kOk;
}

}  // namespace cab
