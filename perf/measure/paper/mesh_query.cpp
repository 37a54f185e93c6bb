#include "perf/measure/paper/mesh_query.h"

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/math/bv/OBBRSS.h>
#include <fcl/narrowphase/collision.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <stdexcept>

#include "perf/base/report.h"
#include "perf/measure/paper/judged_hits.h"

namespace cab::perf {
namespace {

using Clock = std::chrono::steady_clock;
using Transform = fcl::Transform3d;
using Vector = fcl::Vector3d;
using Model = fcl::BVHModel<fcl::OBBRSSd>;

// The transform of a pose. Its rotation goes through a quaternion, which removes the rounding of the floats.
Transform transform_of(const float* pose) {
  fcl::Matrix3d rotation;
  Vector translation;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) rotation(r, c) = static_cast<double>(pose[4 * r + c]);
    translation[r] = static_cast<double>(pose[4 * r + 3]);
  }
  Transform transform = Transform::Identity();
  transform.linear() = fcl::Quaterniond(rotation).normalized().toRotationMatrix();
  transform.translation() = translation;
  return transform;
}

// How many differences are described one by one.
constexpr std::size_t kMaxDifferences = 5;

const float* pose_of(const scenes::Scene& scene, std::uint32_t character, std::uint32_t frame, std::uint32_t link) {
  const scenes::Character& source = scene.characters[character];
  const std::size_t floats = pose_floats(source.pose_format);
  return source.poses.data() + (std::size_t{frame} * source.link_parents.size() + link) * floats;
}

}  // namespace

struct MeshBody::Surface {
  Model model;

  // Whether a point that is not on the surface lies inside. The solid angles of the triangles sum to 4 pi if the
  // surface winds about the point, else to 0 (Van Oosterom and Strackee 1983).
  bool holds(const Vector& point) const {
    if (!model.aabb_local.contain(point)) return false;
    double half_angle = 0;
    for (int t = 0; t < model.num_tris; ++t) {
      const fcl::Triangle& corners = model.tri_indices[t];
      const Vector a = model.vertices[corners[0]] - point, b = model.vertices[corners[1]] - point,
                   c = model.vertices[corners[2]] - point;
      const double la = a.norm(), lb = b.norm(), lc = c.norm();
      half_angle += std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + a.dot(c) * lb + b.dot(c) * la);
    }
    return half_angle > fcl::constantsd::pi();  // 2 pi inside, 0 outside
  }
};

MeshBody::MeshBody(const scenes::TriangleMesh& mesh) : surface_(std::make_unique<Surface>()) {
  std::vector<Vector> vertices;
  for (std::size_t v = 0; v < mesh.vertices.size(); v += 3)
    vertices.emplace_back(mesh.vertices[v], mesh.vertices[v + 1], mesh.vertices[v + 2]);
  std::vector<fcl::Triangle> triangles;
  for (std::size_t t = 0; t < mesh.triangles.size(); t += 3)
    triangles.emplace_back(mesh.triangles[t], mesh.triangles[t + 1], mesh.triangles[t + 2]);
  Model& model = surface_->model;
  const bool built = model.beginModel() == fcl::BVH_OK && model.addSubModel(vertices, triangles) == fcl::BVH_OK &&
                     model.endModel() == fcl::BVH_OK;
  if (!built) throw std::runtime_error("FCL builds no hierarchy over the triangle mesh");
  model.computeLocalAABB();
}

MeshBody::~MeshBody() = default;

MeshAnswer MeshBody::query(const float* pose_a, const MeshBody& b, const float* pose_b) const {
  const Model &model_a = surface_->model, &model_b = b.surface_->model;
  const Transform at_a = transform_of(pose_a), at_b = transform_of(pose_b);
  fcl::CollisionRequestd request;
  request.num_max_contacts = 1;
  request.enable_contact = false;
  fcl::CollisionResultd result;
  if (fcl::collide(&model_a, at_a, &model_b, at_b, request, result) > 0) return MeshAnswer::kSurfacesMeet;
  // If no triangles overlap, a body is inside the other with all its vertices or with no vertex.
  const Transform a_to_b = at_b.inverse() * at_a;
  const bool nested =
      b.surface_->holds(a_to_b * model_a.vertices[0]) || surface_->holds(a_to_b.inverse() * model_b.vertices[0]);
  return nested ? MeshAnswer::kNested : MeshAnswer::kApart;
}

MeshQueries::MeshQueries(const scenes::Scene& scene) : scene_(scene), link_(scenes::dented_link_mesh()) {
  const std::vector<std::vector<float>> pieces = scenes::dented_link_pieces();
  const auto is_piece = [](const scenes::ShapePart& part, const std::vector<float>& piece) {
    return part.vertices == piece;
  };
  for (const scenes::Character& character : scene.characters) {
    bool fits = character.pose_format == PoseFormat::kMatrix3x4Rows && character.origins.empty() &&
                !character.is_static && character.leaves.size() == character.link_parents.size();
    for (const scenes::BodyLeaf& leaf : character.leaves)
      fits = fits && std::equal(leaf.parts.begin(), leaf.parts.end(), pieces.begin(), pieces.end(), is_piece);
    if (!fits) throw std::runtime_error(character.name + ": its links are not those that the triangle mesh is of");
  }
}

std::vector<Touch> MeshQueries::touching(const std::vector<Touch>& pairs) {
  const auto start = Clock::now();
  std::vector<Touch> hits;
  for (const Touch& pair : pairs) {
    const MeshAnswer answer = link_.query(pose_of(scene_, pair.character_a, pair.frame, pair.link_a), link_,
                                          pose_of(scene_, pair.character_b, pair.frame, pair.link_b));
    if (answer == MeshAnswer::kApart) continue;
    if (answer == MeshAnswer::kNested) ++nested_count_;
    hits.push_back(pair);
  }
  seconds_ += std::chrono::duration<double>(Clock::now() - start).count();
  return hits;
}

std::vector<std::string> differing_hits(const scenes::Scene& scene, const std::vector<Touch>& on_pieces,
                                        const std::vector<Touch>& on_meshes) {
  const HitDifference difference = difference_of(on_pieces, on_meshes);
  std::vector<std::string> texts;
  for (const Touch& touch : difference.only_first)
    texts.push_back(describe(scene, touch) + ", on pieces alone, depth " + shortest(touch.contact.depth));
  for (const Touch& touch : difference.only_second) texts.push_back(describe(scene, touch) + ", on meshes alone");
  if (texts.size() > kMaxDifferences) {
    const std::size_t more = texts.size() - kMaxDifferences;
    texts.resize(kMaxDifferences);
    texts.push_back(std::to_string(more) + " more");
  }
  return texts;
}

}  // namespace cab::perf
