// A checked skin, and how its joints and bodies stand in a pose.
#include "scenes/rig/posed_skin.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace cab::scenes {
namespace {

using rig::SkinStatus;

Affine affine(const float* m) {
  Affine a;
  for (std::size_t k = 0; k < 3; ++k) {
    for (std::size_t c = 0; c < 3; ++c) a.columns[k][c] = m[4 * k + c];
    a.translation[k] = m[12 + k];
  }
  return a;
}

// Whether a span says where its values are.
template <class T>
bool has_data(Span<const T> values) {
  return values.data != nullptr || values.empty();
}

bool all_finite(Span<const float> values) {
  return std::all_of(values.begin(), values.end(), [](float value) { return std::isfinite(value); });
}

}  // namespace

SkinStatus CheckedSkin::check(const rig::Skin& skin) {
  skin_ = &skin;
  const std::size_t joints = skin.joint_parents.size;
  if (joints == 0 || !has_data(skin.joint_parents)) return SkinStatus::kBadJoints;
  for (std::size_t j = 0; j < joints; ++j)
    if (skin.joint_parents[j] < -1 || skin.joint_parents[j] >= static_cast<std::int64_t>(j))
      return SkinStatus::kBadJoints;
  if (skin.poses.empty() || !has_data(skin.poses) || skin.poses.size % (16 * joints) != 0 || !all_finite(skin.poses))
    return SkinStatus::kBadPoses;
  const std::size_t vertex_count = skin.vertices.size / 3;
  if (skin.vertices.empty() || !has_data(skin.vertices) || skin.vertices.size % 3 != 0 || !all_finite(skin.vertices))
    return SkinStatus::kBadVertices;
  if (skin.triangles.size % 3 != 0 || !has_data(skin.triangles)) return SkinStatus::kBadTriangles;
  for (const std::uint32_t v : skin.triangles)
    if (v >= vertex_count) return SkinStatus::kBadTriangles;
  const std::size_t bones = skin.inverse_bind.size / 16;
  if (!has_data(skin.inverse_bind) || !has_data(skin.bone_joints)) return SkinStatus::kBadBones;
  if (bones == 0 || skin.inverse_bind.size % 16 != 0 || !all_finite(skin.inverse_bind)) return SkinStatus::kBadBones;
  if (skin.bone_joints.empty() ? bones > joints : skin.bone_joints.size != bones) return SkinStatus::kBadBones;
  for (const std::uint32_t joint : skin.bone_joints)
    if (joint >= joints) return SkinStatus::kBadBones;
  const std::size_t width = skin.influence_count;
  if (!has_data(skin.influence_bones) || !has_data(skin.influence_weights)) return SkinStatus::kBadInfluences;
  // In 64 bits, which hold the product where std::size_t has 32.
  const std::uint64_t influences = std::uint64_t{skin.influence_count} * vertex_count;
  if (skin.influence_bones.size != influences || skin.influence_weights.size != influences)
    return SkinStatus::kBadInfluences;

  for (std::size_t b = 0; b < bones; ++b) inverse_bind_.push_back(affine(skin.inverse_bind.data + 16 * b));
  influences_.resize(vertex_count);
  for (std::size_t v = 0; v < vertex_count; ++v) {
    double sum = 0;
    for (std::size_t i = v * width; i < (v + 1) * width; ++i) {
      const float weight = skin.influence_weights[i];
      if (!(weight >= 0) || !std::isfinite(weight)) return SkinStatus::kBadInfluences;
      if (weight == 0) continue;
      if (skin.influence_bones[i] >= bones) return SkinStatus::kBadInfluences;
      influences_[v].push_back({skin.influence_bones[i], weight});
      sum += weight;
    }
    for (Influence& influence : influences_[v]) influence.weight /= sum;
  }
  const auto add = [&](const Triangle& t, std::uint32_t source) {
    if (influences_[t[0]].empty() || influences_[t[1]].empty() || influences_[t[2]].empty()) return;
    triangles_.push_back(t);
    sources_.push_back(source);
  };
  for (std::uint32_t t = 0; t < skin.triangles.size / 3; ++t) {
    const std::uint32_t* const corners = skin.triangles.data + 3 * std::size_t{t};
    add({corners[0], corners[1], corners[2]}, t);
  }
  if (skin.triangles.empty())
    for (std::uint32_t v = 0; v < vertex_count; ++v) add({v, v, v}, v);
  return triangles_.empty() ? SkinStatus::kNoBodies : SkinStatus::kOk;
}

std::uint32_t CheckedSkin::joint_of(std::uint32_t bone) const {
  return skin_->bone_joints.empty() ? bone : skin_->bone_joints[bone];
}

Vec3 CheckedSkin::vertex(std::uint32_t v) const {
  const float* const p = skin_->vertices.data + 3 * std::size_t{v};
  return {p[0], p[1], p[2]};
}

std::vector<Affine> CheckedSkin::joints(std::size_t pose) const {
  std::vector<Affine> matrices;
  for (std::size_t j = 0; j < joint_count(); ++j)
    matrices.push_back(affine(skin_->poses.data + 16 * (pose * joint_count() + j)));
  return matrices;
}

std::vector<Vec3> CheckedSkin::vertices(const std::vector<Affine>& joints) const {
  std::vector<Affine> bones;
  for (std::uint32_t b = 0; b < inverse_bind_.size(); ++b)
    bones.push_back(multiply(joints[joint_of(b)], inverse_bind_[b]));
  std::vector<Vec3> moved(influences_.size(), Vec3{0, 0, 0});
  for (std::uint32_t v = 0; v < moved.size(); ++v)
    for (const auto& [bone, weight] : influences_[v])
      moved[v] = moved[v] + weight * (transform(bones[bone], vertex(v)));
  return moved;
}

RigidFrame rigid_frame(const Affine& joint) { return {rotation_of(joint), joint.translation}; }

PosedBodies::PosedBodies(const std::vector<LinkSolid>& bodies, Span<const std::uint32_t> joints,
                         const std::vector<Affine>& pose)
    : bodies_(bodies) {
  for (const std::uint32_t joint : joints) frames_.push_back(rigid_frame(pose[joint]));
  for (const LinkSolid& body : bodies) centres_.push_back(frames_[body.link].out(body.solid.centre));
}

bool PosedBodies::is_beyond(std::size_t body, const Vec3& point, double distance) const {
  return length(point - centres_[body]) > bodies_[body].solid.radius + distance;
}

bool PosedBodies::is_inside(const Vec3& point, std::uint32_t link) const {
  const auto contains = [&](std::size_t b) {
    return !is_beyond(b, point, kMargin * bodies_[b].solid.radius) &&
           scenes::is_inside(bodies_[b].solid, frames_[bodies_[b].link].in(point));
  };
  for (std::size_t b = 0; b < bodies_.size(); ++b)
    if (bodies_[b].link == link && contains(b)) return true;
  for (std::size_t b = 0; b < bodies_.size(); ++b)
    if (bodies_[b].link != link && contains(b)) return true;
  return false;
}

double PosedBodies::distance_above(const Vec3& point, std::uint32_t link, double least) const {
  double nearest = std::numeric_limits<double>::infinity();
  for (const bool of_link : {true, false})
    for (std::size_t b = 0; b < bodies_.size() && nearest > least; ++b)
      if ((bodies_[b].link == link) == of_link && !is_beyond(b, point, nearest))
        nearest = std::min(nearest, distance(bodies_[b].solid, frames_[bodies_[b].link].in(point)));
  return std::max(nearest, least);
}

std::array<Vec3, 7> samples(const std::array<Vec3, 3>& corners) {
  const auto& [a, b, c] = corners;
  // The corners of the four quarters are a, b, c and the middles of the edges.
  return {a,
          b,
          c,
          (1.0 / 3) * (a + b + c),
          (1.0 / 6) * (4.0 * a + b + c),
          (1.0 / 6) * (4.0 * b + a + c),
          (1.0 / 6) * (4.0 * c + a + b)};
}

}  // namespace cab::scenes
