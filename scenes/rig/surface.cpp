// The surface of a skin as leaves of triangles.
#include <cab/cab.h>
#include <cab/skin.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <new>

#include "scenes/random.h"
#include "scenes/rig/surface_cuts.h"

namespace cab::scenes {
namespace {

using rig::SkinStatus;
using rig::SurfaceInfo;
using rig::SurfaceRules;

// Leaves are cut by at most this many of the skin's poses, evenly spaced.
constexpr std::size_t kMostSamplePoses = 64;
// A skin of one pose is bent into this many: at every joint about a random axis, by an angle up to the largest.
constexpr int kMadePoses = 16;
constexpr double kMostMadeAngle = 0.698131700797732;  // 40 degrees
constexpr std::uint64_t kMadeSeed = 1;

bool are_valid(const SurfaceRules& rules) {
  return rules.most_triangles >= 1 && rules.max_leaves >= 1 && rules.max_leaves <= kMaxLeaves &&
         rules.most_growth >= 1 && rules.least_triangles >= 1;
}

std::vector<RigidFrame> link_frames(const CheckedSkin& skin, const LinkMap& map, std::size_t pose) {
  const std::vector<Affine> joints = skin.joints(pose);
  std::vector<RigidFrame> frames;
  for (const std::uint32_t joint : map.joints) frames.push_back(rigid_frame(joints[joint]));
  return frames;
}

// The poses of links by which leaves are cut, one pose after the other.
std::vector<RigidFrame> sample_poses(const CheckedSkin& skin, const LinkMap& map) {
  std::vector<RigidFrame> poses;
  const auto append = [&poses](const std::vector<RigidFrame>& pose) {
    poses.insert(poses.end(), pose.begin(), pose.end());
  };
  const std::size_t step = (skin.pose_count() + kMostSamplePoses - 1) / kMostSamplePoses;
  for (std::size_t p = 0; p < skin.pose_count(); p += step) append(link_frames(skin, map, p));
  if (skin.pose_count() > 1) return poses;
  const std::vector<RigidFrame> rest = poses;
  Random random(kMadeSeed);
  for (int n = 0; n < kMadePoses; ++n) {
    std::vector<RigidFrame> bent = rest;
    for (std::size_t l = 1; l < bent.size(); ++l) {
      const auto parent = static_cast<std::size_t>(map.parents[l]);
      const Vec3 axis = random.unit_vector();
      const double half_angle = random.uniform(0, kMostMadeAngle) / 2, sine = std::sin(half_angle);
      const Quat turn = {sine * axis[0], sine * axis[1], sine * axis[2], std::cos(half_angle)};
      const Quat back = conjugate(rest[parent].rotation);
      bent[l].position = bent[parent].out(rest[parent].in(rest[l].position));
      bent[l].rotation = multiply(bent[parent].rotation, multiply(multiply(back, rest[l].rotation), turn));
    }
    append(bent);
  }
  return poses;
}

// How far vertices are from where the skin moves them.
void measure_distance(const CheckedSkin& skin, const LinkMap& map, const SurfaceMesh& mesh, SurfaceInfo& info) {
  for (std::size_t p = 0; p < skin.pose_count(); ++p) {
    const std::vector<Vec3> given = skin.vertices(skin.joints(p));
    const std::vector<Affine> bones = link_bones(mesh, link_frames(skin, map, p));
    for (std::size_t v = 0; v < given.size(); ++v) {
      if (mesh.index_of[v] == kNoVertex) continue;
      const double distance = length(given[v] - posed_vertex(mesh, bones.data(), mesh.index_of[v]));
      if (!(distance > info.worst_distance)) continue;
      info.worst_distance = distance;
      info.worst_pose = static_cast<std::uint32_t>(p);
    }
  }
}

// The box about a cluster as its link alone would move it. The library has taken the cluster, so it has a box.
Box box_in_link(const SurfaceMesh& mesh, const Cluster& cluster) {
  const Affine bind = link_bones(mesh, std::vector<RigidFrame>(mesh.skin.inverse_bind.size() / 16))[cluster.link];
  std::vector<float> points;
  for (const std::uint32_t v : vertices_of(mesh, cluster))
    for (const double x : transform(bind, place_of(mesh, v))) points.push_back(static_cast<float>(x));
  Box box;
  if (fit_box(points, &box) != Status::kOk) throw std::bad_alloc();
  return box;
}

void describe(const SurfaceMesh& mesh, const std::vector<Cluster>& clusters, rig::SkinBodyStorage& storage) {
  storage.surface = mesh.skin;
  for (const Cluster& cluster : clusters)
    for (const std::uint32_t t : cluster.triangles) {
      storage.surface.triangles.insert(storage.surface.triangles.end(), mesh.triangles[t].begin(),
                                       mesh.triangles[t].end());
      storage.surface.sources.push_back(mesh.sources[t]);
    }
  const std::uint32_t* next = storage.surface.triangles.data();
  for (const Cluster& cluster : clusters) {
    Leaf leaf;
    leaf.link = cluster.link;
    leaf.triangles = {next, 3 * cluster.triangles.size()};
    leaf.box = box_in_link(mesh, cluster);
    next += leaf.triangles.size;
    storage.leaves.push_back(leaf);
  }
}

SurfaceInfo info_of(const SurfaceMesh& mesh, const std::vector<Cluster>& clusters) {
  SurfaceInfo info;
  info.triangle_count = static_cast<std::uint32_t>(mesh.triangles.size());
  info.left_out_count = mesh.left_out_count;
  info.vertex_count = static_cast<std::uint32_t>(mesh.skin.vertices.size() / 3);
  info.welded_count = mesh.welded_count;
  double grown = 0, tight = 0;
  for (std::size_t n = 0; n < clusters.size(); ++n) {
    info.link_count += n == 0 || clusters[n].link != clusters[n - 1].link;
    info.most_triangles = std::max(info.most_triangles, static_cast<std::uint32_t>(clusters[n].triangles.size()));
    info.most_influences = std::max(info.most_influences, count_links(mesh, clusters[n]));
    grown += clusters[n].grown;
    tight += clusters[n].tight;
  }
  info.growth = tight > 0 ? grown / tight : 1;
  const MeshParts parts = parts_of(mesh);
  info.part_count = parts.count;
  info.open_part_count = parts.open_count;
  info.open_edge_count = parts.open_edge_count;
  return info;
}

SkinStatus make_surface(const rig::Skin& skin, const SurfaceRules& rules, rig::SkinBodyStorage& storage,
                        SurfaceInfo& info, std::uint32_t& bad_bone) {
  CheckedSkin checked;
  if (const SkinStatus status = checked.check(skin); status != SkinStatus::kOk) return status;
  if (skin.triangles.empty()) return SkinStatus::kBadTriangles;
  if (!are_valid(rules)) return SkinStatus::kBadRules;
  const std::vector<Affine> rest = checked.joints(0);
  const rig::BodyRules every_joint;
  const LinkMap map = map_links(checked, skin.joint_parents, every_joint, rest);
  if (map.joints.size() > kMaxLinks) return SkinStatus::kTooManyLinks;
  LinkBinds binds;
  if (const SkinStatus status = make_link_binds(checked, map, rest, binds, bad_bone); status != SkinStatus::kOk)
    return status;
  const SurfaceMesh mesh = make_surface_mesh(checked, map, binds, skin.triangles.size / 3);
  if (mesh.triangles.empty()) return SkinStatus::kNoBodies;
  std::vector<Cluster> clusters;
  SkinStatus status = cut_by_place(mesh, rules, clusters);
  SurfaceRules fitting = rules;
  while (status == SkinStatus::kTooManyLeaves && fitting.most_triangles < mesh.triangles.size()) {
    fitting.most_triangles = static_cast<std::uint32_t>(
        std::min<std::size_t>(2 * std::size_t{fitting.most_triangles}, mesh.triangles.size()));
    clusters.clear();
    status = cut_by_place(mesh, fitting, clusters);
  }
  if (status != SkinStatus::kOk) return status;
  status = cut_where_it_bends(mesh, map.parents, sample_poses(checked, map), fitting, clusters);
  if (status != SkinStatus::kOk) return status;
  storage.joint_count = checked.joint_count();
  storage.link_parents = map.parents;
  storage.joints = map.joints;
  storage.ignored_pairs = neighbour_links(checked, map, static_cast<double>(every_joint.shared_weight));
  describe(mesh, clusters, storage);
  info = info_of(mesh, clusters);
  measure_distance(checked, map, mesh, info);
  return SkinStatus::kOk;
}

}  // namespace
}  // namespace cab::scenes

namespace cab::rig {

SkinStatus surface_from_skin(const Skin& skin, const SurfaceRules& rules, SkinBodies* out, SurfaceInfo* info,
                             std::uint32_t* bad_bone) noexcept {
  if (out == nullptr) return SkinStatus::kBadOutput;
  try {
    auto storage = std::make_unique<SkinBodyStorage>();
    SurfaceInfo made;
    std::uint32_t bone = 0;
    const SkinStatus status = scenes::make_surface(skin, rules, *storage, made, bone);
    const bool is_of_bone = status == SkinStatus::kNoInverse || status == SkinStatus::kBindsDiffer;
    if (is_of_bone && bad_bone != nullptr) *bad_bone = bone;
    if (status != SkinStatus::kOk) return status;
    SkinBodies bodies;
    SkinBodiesAccess::set(bodies, storage.release());
    *out = static_cast<SkinBodies&&>(bodies);
    if (info != nullptr) *info = made;
    return SkinStatus::kOk;
  } catch (const std::bad_alloc&) { return SkinStatus::kOutOfMemory; }
}

}  // namespace cab::rig
