// Bodies from a skin: which triangles a link owns, and solids about them.
#include <cab/skin.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <new>

#include "scenes/rig/desc_of.h"
#include "scenes/rig/leaf_range.h"
#include "scenes/rig/posed_skin.h"
#include "scenes/rig/skin_links.h"

namespace cab::scenes {
namespace {

using rig::BodyRules;
using rig::SkinStatus;

constexpr std::uint32_t kAllKinds =
    rig::kHullBody | rig::kBoxBody | rig::kCapsuleBody | rig::kSphereBody | rig::kEllipsoidBody;
// A cut of a leaf must save this share of its hull's volume.
constexpr double kLeastSaving = .05;
// Cuts are tried at this many places, at equal counts of triangles.
constexpr std::size_t kCutCount = 7;
// The hulls that cuts are judged by have at most this many vertices.
constexpr std::size_t kCutHullVertices = 32;
// Growing bodies makes them leave out points that they held by chance. It ends after this many rounds over all poses.
constexpr int kMaxInflationRounds = 16;

// A triangle that a link owns, in the link's frame.
struct OwnedTriangle {
  std::uint32_t index;
  std::array<Vec3, 3> corners;
};

// A leaf to be, and the points that it must hold.
struct LeafPlan {
  std::uint32_t link = 0;
  std::vector<OwnedTriangle> triangles;
  std::vector<Vec3> points;
};

bool are_valid(const BodyRules& rules, std::size_t joint_count) {
  const bool in_range = rules.kinds != 0 && (rules.kinds & ~kAllKinds) == 0 && rules.max_hull_vertices >= 4 &&
                        rules.max_hull_vertices <= 1024 && rules.leaves_per_link >= 1 && rules.leaves_per_link <= 64 &&
                        rules.shared_weight > 0 && rules.shared_weight <= 1 && rules.least_reach >= 0 &&
                        std::isfinite(rules.least_reach);
  if (rules.kept_joints.data == nullptr && !rules.kept_joints.empty()) return false;
  return in_range && std::all_of(rules.kept_joints.begin(), rules.kept_joints.end(),
                                 [=](std::uint32_t joint) { return joint < joint_count; });
}

// Gives each triangle to its links: one leaf plan per link, without points. Writes the owners of triangles.
std::vector<LeafPlan> own_triangles(const CheckedSkin& skin, const LinkMap& map, const std::vector<Affine>& pose,
                                    double shared_weight, rig::SkinBodyStorage& storage) {
  const std::vector<Vec3> vertices = skin.vertices(pose);
  std::vector<RigidFrame> frames;
  for (const std::uint32_t joint : map.joints) frames.push_back(rigid_frame(pose[joint]));
  std::vector<LeafPlan> plans(map.joints.size());
  for (std::uint32_t l = 0; l < plans.size(); ++l) plans[l].link = l;
  for (std::uint32_t t = 0; t < skin.triangles().size(); ++t) {
    const Triangle& triangle = skin.triangles()[t];
    const std::map<std::uint32_t, double> weights = link_weights(skin, map, triangle);
    const std::uint32_t owner = owner_of(weights);
    storage.owners.push_back(owner);
    for (const auto& [link, weight] : weights) {
      if (link != owner && weight < shared_weight) continue;
      plans[link].triangles.push_back({t, {}});
      for (std::size_t k = 0; k < 3; ++k)
        plans[link].triangles.back().corners[k] = frames[link].in(vertices[triangle[k]]);
    }
  }
  return plans;
}

std::vector<Vec3> corners_of(const std::vector<OwnedTriangle>& triangles) {
  std::vector<Vec3> points;
  for (const OwnedTriangle& triangle : triangles)
    points.insert(points.end(), triangle.corners.begin(), triangle.corners.end());
  return points;
}

double hull_volume(const std::vector<OwnedTriangle>& triangles) {
  return convex_hull(corners_of(triangles), kCutHullVertices).volume;
}

// A cut of a leaf in two along the longest axis of its box, and the volume that it saves.
struct Cut {
  LeafPlan low, high;
  double saving = 0;
};

Cut best_cut(const LeafPlan& plan) {
  Cut best;
  const double whole = hull_volume(plan.triangles);
  if (!(whole > 0)) return best;
  const Box box = fit_solid(corners_of(plan.triangles), rig::kBoxBody, 4).box;
  const auto longest = static_cast<std::size_t>(std::max_element(box.half, box.half + 3) - box.half);
  const Vec3 axis = {box.axis[longest][0], box.axis[longest][1], box.axis[longest][2]};
  const auto height = [&](const OwnedTriangle& t) { return dot(axis, t.corners[0] + t.corners[1] + t.corners[2]); };
  std::vector<OwnedTriangle> sorted = plan.triangles;
  std::stable_sort(sorted.begin(), sorted.end(),
                   [&](const OwnedTriangle& a, const OwnedTriangle& b) { return height(a) < height(b); });
  for (std::size_t c = 1; c <= kCutCount; ++c) {
    const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() * c / (kCutCount + 1));
    LeafPlan low = {plan.link, {sorted.begin(), middle}, {}}, high = {plan.link, {middle, sorted.end()}, {}};
    if (low.triangles.empty()) continue;
    const double saving = whole - hull_volume(low.triangles) - hull_volume(high.triangles);
    if (saving > std::max(best.saving, kLeastSaving * whole)) best = {std::move(low), std::move(high), saving};
  }
  return best;
}

// Cuts the leaf of a link until it has as many as the rules allow.
std::vector<LeafPlan> cut_leaves(LeafPlan whole, std::uint32_t most) {
  std::vector<LeafPlan> leaves = {std::move(whole)};
  std::vector<Cut> cuts;
  if (most > 1) cuts.push_back(best_cut(leaves[0]));
  while (leaves.size() < most) {
    const auto best =
        std::max_element(cuts.begin(), cuts.end(), [](const Cut& a, const Cut& b) { return a.saving < b.saving; });
    if (!(best->saving > 0)) break;
    leaves[static_cast<std::size_t>(best - cuts.begin())] = best->low;
    leaves.push_back(std::move(best->high));
    *best = best_cut(best->low);
    cuts.push_back(best_cut(leaves.back()));
  }
  return leaves;
}

Solid fit(LeafPlan& plan, const BodyRules& rules) {
  // Points inside the hull have no effect, now and when the leaf grows.
  Hull hull = convex_hull(plan.points, plan.points.size());
  if (!hull.faces.empty()) plan.points = std::move(hull.vertices);
  return fit_solid(plan.points, rules.kinds, rules.max_hull_vertices);
}

// Adds to the leaves what sticks out of them in any pose: whole triangles, each to the leaf that owns it. False if that
// is out of range.
bool inflate(const CheckedSkin& skin, const BodyRules& rules, std::vector<LeafPlan>& plans,
             rig::SkinBodyStorage& storage) {
  std::vector<std::size_t> leaf_of(skin.triangles().size());
  for (std::size_t n = 0; n < plans.size(); ++n)
    for (const OwnedTriangle& triangle : plans[n].triangles)
      if (storage.owners[triangle.index] == plans[n].link) leaf_of[triangle.index] = n;
  const Span<const std::uint32_t> joints = storage.joints;
  bool grows = true;
  for (int round = 0; grows && round < kMaxInflationRounds; ++round) {
    grows = false;
    for (std::size_t p = 0; p < skin.pose_count(); ++p) {
      const std::vector<Affine> pose = skin.joints(p);
      const std::vector<Vec3> vertices = skin.vertices(pose);
      const PosedBodies bodies(storage.solids, joints, pose);
      std::vector<bool> has_grown(plans.size(), false);
      for (std::size_t t = 0; t < skin.triangles().size(); ++t) {
        const auto& [a, b, c] = skin.triangles()[t];
        const std::array<Vec3, 3> corners = {vertices[a], vertices[b], vertices[c]};
        const std::array<Vec3, 7> points = samples(corners);
        if (std::all_of(points.begin(), points.end(),
                        [&](const Vec3& point) { return bodies.is_inside(point, storage.owners[t]); }))
          continue;
        for (const Vec3& corner : corners)
          plans[leaf_of[t]].points.push_back(bodies.frame(storage.owners[t]).in(corner));
        has_grown[leaf_of[t]] = true;
        grows = true;
      }
      for (std::size_t n = 0; n < plans.size(); ++n) {
        if (!has_grown[n]) continue;
        if (!are_in_range(plans[n].points)) return false;
        storage.solids[n].solid = fit(plans[n], rules);
      }
    }
  }
  return true;
}

void describe(rig::SkinBodyStorage& storage) {
  for (const LinkSolid& body : storage.solids) storage.parts.push_back(body.solid.part);
  for (std::size_t n = 0; n < storage.solids.size(); ++n) {
    const LinkSolid& body = storage.solids[n];
    storage.parts[n].vertices = body.solid.vertices;
    Leaf leaf;
    leaf.link = body.link;
    leaf.box = body.solid.box;
    if (body.solid.has_part) leaf.parts = {&storage.parts[n], 1};
    storage.leaves.push_back(leaf);
  }
}

SkinStatus make_bodies(const rig::Skin& skin, const BodyRules& rules, rig::SkinBodyStorage& storage) {
  CheckedSkin checked;
  const SkinStatus status = checked.check(skin);
  if (status != SkinStatus::kOk) return status;
  if (!are_valid(rules, checked.joint_count())) return SkinStatus::kBadRules;
  const std::vector<Affine> rest = checked.joints(0);
  const LinkMap map = map_links(checked, skin.joint_parents, rules, rest);
  if (map.joints.empty()) return SkinStatus::kNoBodies;
  if (map.joints.size() > kMaxLinks) return SkinStatus::kTooManyLinks;
  storage.joint_count = checked.joint_count();
  storage.link_parents = map.parents;
  storage.joints = map.joints;
  storage.ignored_pairs = neighbour_links(checked, map, static_cast<double>(rules.shared_weight));
  std::vector<LeafPlan> plans;
  for (LeafPlan& whole : own_triangles(checked, map, rest, static_cast<double>(rules.shared_weight), storage)) {
    if (whole.triangles.empty()) continue;
    if (!are_in_range(corners_of(whole.triangles))) return SkinStatus::kBadVertices;
    for (LeafPlan& leaf : cut_leaves(std::move(whole), rules.leaves_per_link)) plans.push_back(std::move(leaf));
  }
  if (plans.size() > kMaxLeaves) return SkinStatus::kTooManyLeaves;
  for (LeafPlan& plan : plans) {
    plan.points = corners_of(plan.triangles);
    storage.solids.push_back({plan.link, fit(plan, rules)});
  }
  if (rules.inflate && !inflate(checked, rules, plans, storage)) return SkinStatus::kBadVertices;
  describe(storage);
  const bool fits = std::all_of(storage.leaves.begin(), storage.leaves.end(), is_in_range);
  return fits ? SkinStatus::kOk : SkinStatus::kBadVertices;
}

}  // namespace
}  // namespace cab::scenes

namespace cab::rig {

const char* to_string(SkinStatus status) noexcept {
  switch (status) {
    case SkinStatus::kOk: return "ok";
    case SkinStatus::kOutOfMemory: return "an allocation failed";
    case SkinStatus::kBadJoints:
      return "joint_parents must hold -1 or an earlier joint for each joint, of which there is at least one";
    case SkinStatus::kBadPoses: return "poses must hold one finite matrix per joint, once or several times";
    case SkinStatus::kBadVertices:
      return "vertices must hold x y z of at least one vertex, all finite and at most 1e18 in the link's frame";
    case SkinStatus::kBadTriangles: return "triangles must hold three indices of vertices each";
    case SkinStatus::kBadBones:
      return "inverse_bind and bone_joints must hold a finite matrix and an existing joint per bone";
    case SkinStatus::kBadInfluences:
      return "influences must be existing bones with finite weights of 0 or more, influence_count per vertex";
    case SkinStatus::kBadRules: return "a rule is out of its range";
    case SkinStatus::kBadOutput: return "an output is null or of the wrong size";
    case SkinStatus::kBadBodies: return "bodies are empty, are no solids, or were made for another number of joints";
    case SkinStatus::kNoBodies: return "no vertex has a weight, or no triangle of a surface has an area";
    case SkinStatus::kTooManyLinks: return "more than 1024 links; a coarser skeleton has fewer";
    case SkinStatus::kTooManyLeaves:
      return "more than 1024 leaves; fewer per link, more triangles in each, or a coarser skeleton";
    case SkinStatus::kNoInverse: return "the matrix of a bone in the first pose has no inverse";
    case SkinStatus::kBindsDiffer:
      return "two bones of one joint have other matrices than moving the vertices of one of them makes up for";
    case SkinStatus::kTooManyInfluences: return "a triangle is moved by more than 33 joints";
  }
  return "unknown";
}

SkinBodies& SkinBodies::operator=(SkinBodies&& other) noexcept {
  if (this == &other) return *this;
  delete storage_;
  storage_ = other.storage_;
  other.storage_ = nullptr;
  return *this;
}

SkinBodies::~SkinBodies() { delete storage_; }

ArticulationDesc SkinBodies::desc() const noexcept {
  ArticulationDesc desc = scenes::desc_of(storage_);
  if (storage_ != nullptr && !storage_->surface.vertices.empty()) desc.skin = storage_->surface.desc();
  return desc;
}

Span<const std::uint32_t> SkinBodies::joints() const noexcept {
  if (storage_ == nullptr) return {};
  return storage_->joints;
}

Span<const std::uint32_t> SkinBodies::source_triangles() const noexcept {
  if (storage_ == nullptr) return {};
  return storage_->surface.sources;
}

SkinStatus bodies_from_skin(const Skin& skin, const BodyRules& rules, SkinBodies* out) noexcept {
  if (out == nullptr) return SkinStatus::kBadOutput;
  try {
    auto storage = std::make_unique<SkinBodyStorage>();
    const SkinStatus status = scenes::make_bodies(skin, rules, *storage);
    if (status != SkinStatus::kOk) return status;
    SkinBodies bodies;
    SkinBodiesAccess::set(bodies, storage.release());
    *out = static_cast<SkinBodies&&>(bodies);
    return SkinStatus::kOk;
  } catch (const std::bad_alloc&) { return SkinStatus::kOutOfMemory; }
}

void rigid_pose(const float (&matrix)[16], float (&pose)[7]) noexcept {
  scenes::Affine joint;
  for (std::size_t k = 0; k < 3; ++k) {
    for (std::size_t c = 0; c < 3; ++c) joint.columns[k][c] = matrix[4 * k + c];
    pose[4 + k] = matrix[12 + k];
  }
  const scenes::Quat rotation = scenes::rotation_of(joint);
  for (std::size_t k = 0; k < 4; ++k) pose[k] = static_cast<float>(rotation[k]);
}

SkinStatus link_poses(const SkinBodies& bodies, Span<const float> matrices, Span<float> poses) noexcept {
  const SkinBodyStorage* const storage = SkinBodiesAccess::get(bodies);
  if (storage == nullptr) return SkinStatus::kBadBodies;
  if (matrices.size != 16 * storage->joint_count || matrices.data == nullptr) return SkinStatus::kBadPoses;
  if (poses.size != 7 * storage->joints.size() || poses.data == nullptr) return SkinStatus::kBadOutput;
  for (std::size_t l = 0; l < storage->joints.size(); ++l) {
    float matrix[16], pose[7];
    std::copy_n(matrices.data + 16 * std::size_t{storage->joints[l]}, 16, matrix);
    rigid_pose(matrix, pose);
    std::copy_n(pose, 7, poses.data + 7 * l);
  }
  return SkinStatus::kOk;
}

}  // namespace cab::rig
