// Step 5 of a frame with Exact::kFcl: FCL with its libccd solver, in double, relative to the origin of instance a.
#include "engine/exact_fcl.h"

#include "engine/convex_hull.h"
#include "layout/error_bounds.h"

#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/convex.h>
#include <fcl/geometry/shape/ellipsoid.h>
#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/detail/convexity_based_algorithm/minkowski_diff.h>
#include <fcl/narrowphase/distance.h>

#include <cmath>
#include <cstring>
#include <exception>
#include <limits>
#include <vector>

namespace cab {
namespace {

using Transform = fcl::Transform3d;
using Matrix = fcl::Matrix3d;
using Vector = fcl::Vector3d;

// One convex part of a leaf: the shape, and its transform to the frame of the link.
struct FclPart {
  std::shared_ptr<fcl::CollisionGeometryd> geometry;
  Transform in_link;
};

Vector vector_of(const float* v) {
  return {static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])};
}

// The rotation of a quaternion x y z w, which may have any length but zero.
Matrix rotation_of(const float* q) {
  return fcl::Quaterniond(static_cast<double>(q[3]), static_cast<double>(q[0]), static_cast<double>(q[1]),
                          static_cast<double>(q[2]))
      .normalized()
      .toRotationMatrix();
}

// Makes the columns of a matrix orthonormal as the posing kernel does, but in double: Gram-Schmidt, where the first
// column keeps its direction.
Matrix orthonormal(Matrix m) {
  m.col(0).normalize();
  m.col(1) -= m.col(1).dot(m.col(0)) * m.col(0);
  m.col(1).normalize();
  m.col(2) = m.col(0).cross(m.col(1));
  return m;
}

Transform make_transform(const Matrix& rotation, const Vector& translation) {
  Transform out = Transform::Identity();
  out.linear() = rotation;
  out.translation() = translation;
  return out;
}

// The FCL shape of a convex part. Null for a hull without volume.
std::shared_ptr<fcl::CollisionGeometryd> geometry_of(const ConvexPart& part) {
  const Vector size = vector_of(part.size);
  switch (part.kind) {
    case ShapeKind::kBox: return std::make_shared<fcl::Boxd>(2 * size);
    case ShapeKind::kEllipsoid: return std::make_shared<fcl::Ellipsoidd>(size);
    case ShapeKind::kCapsule: return std::make_shared<fcl::Capsuled>(size[0], 2 * size[1]);
    default: break;
  }
  const ConvexHull hull = convex_hull(part.vertices);
  if (hull.face_count == 0) return nullptr;
  auto vertices = std::make_shared<std::vector<Vector>>();
  for (std::size_t v = 0; v < hull.vertices.size(); v += 3)
    vertices->emplace_back(hull.vertices[v], hull.vertices[v + 1], hull.vertices[v + 2]);
  return std::make_shared<fcl::Convexd>(vertices, hull.face_count, std::make_shared<std::vector<int>>(hull.faces));
}

// A leaf box as a part.
FclPart box_part(const Box& box) {
  Matrix axes;
  for (int k = 0; k < 3; ++k) axes.col(k) = vector_of(box.axis[k]);
  return {std::make_shared<fcl::Boxd>(2 * vector_of(box.half)),
          make_transform(orthonormal(axes), vector_of(box.center))};
}

// The pose of a link in world axes, relative to the origin of its instance, in double.
Transform link_pose(const InstanceBatch& batch, std::uint32_t instance, std::uint32_t link) {
  const BatchInput& input = *batch.input;
  const std::byte* from = reinterpret_cast<const std::byte*>(input.poses.data) + instance * batch.instance_stride +
                          link * batch.link_stride;
  Transform pose;
  if (input.poses.format == PoseFormat::kQuaternionTranslation) {
    float f[7];
    std::memcpy(f, from, sizeof(f));
    pose = make_transform(rotation_of(f), vector_of(f + 4));
  } else {
    float f[16];
    const bool rows = input.poses.format == PoseFormat::kMatrix3x4;
    std::memcpy(f, from, rows ? 12 * sizeof(float) : sizeof(f));
    Matrix m;
    Vector t;
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) m(r, c) = static_cast<double>(rows ? f[4 * r + c] : f[4 * c + r]);
      t[r] = static_cast<double>(rows ? f[4 * r + 3] : f[12 + r]);
    }
    pose = make_transform(orthonormal(m), t);
  }
  if (!input.orientations.empty())
    pose = make_transform(rotation_of(input.orientations.data + 4 * std::size_t{instance}), Vector::Zero()) * pose;
  return pose;
}

}  // namespace

// The shapes of one articulation.
class FclShapes {
 public:
  std::vector<std::vector<FclPart>> leaves;  // by leaf: its parts
  std::vector<std::uint32_t> leaf_link;      // by leaf: the index of its link
};

void FclShapesDelete::operator()(FclShapes* shapes) const { delete shapes; }

Status make_fcl_shapes(const Articulation& articulation, std::unique_ptr<FclShapes, FclShapesDelete>* out,
                       std::uint32_t* bad_leaf) {
  std::unique_ptr<FclShapes, FclShapesDelete> shapes(new FclShapes);
  for (std::uint32_t leaf = 0; leaf < articulation.leaf_count; ++leaf) {
    std::vector<FclPart> parts;
    for (std::uint32_t p = articulation.leaf_part_begin[leaf]; p < articulation.leaf_part_begin[leaf + 1]; ++p) {
      const ConvexPart& part = articulation.parts[p];
      auto geometry = geometry_of(part);
      if (!geometry) {
        if (bad_leaf) *bad_leaf = leaf;
        return Status::kBadShape;
      }
      parts.push_back({std::move(geometry), make_transform(rotation_of(part.rotation), vector_of(part.position))});
    }
    if (parts.empty()) parts.push_back(box_part(articulation.leaf_box[leaf]));
    for (const FclPart& part : parts) part.geometry->computeLocalAABB();  // sets aabb_radius, which find_gap reads
    shapes->leaves.push_back(std::move(parts));
    shapes->leaf_link.push_back(articulation.leaf_link[leaf]);
  }
  *out = std::move(shapes);
  return Status::kOk;
}

namespace {

// A part of a leaf in a frame. The pose is relative to the origin of instance a.
struct PosedPart {
  const FclPart* part;
  Transform pose;

  const fcl::CollisionGeometryd* geometry() const { return part->geometry.get(); }
};

// Calls visit(part of a, part of b) for every part of leaf a and every part of leaf b, until visit returns true.
template <class Visit>
bool visit_parts(const ExactLeaf& a, const ExactLeaf& b, Visit&& visit) {
  const Transform pose_a = link_pose(*a.batch, a.instance, a.fcl_shapes->leaf_link[a.leaf]);
  Transform pose_b = link_pose(*b.batch, b.instance, b.fcl_shapes->leaf_link[b.leaf]);
  for (std::uint32_t c = 0; c < 3; ++c)
    pose_b.translation()[c] += origin_of(*b.batch, b.instance, c) - origin_of(*a.batch, a.instance, c);
  for (const FclPart& part_a : a.fcl_shapes->leaves[a.leaf])
    for (const FclPart& part_b : b.fcl_shapes->leaves[b.leaf])
      if (visit(PosedPart{&part_a, pose_a * part_a.in_link}, PosedPart{&part_b, pose_b * part_b.in_link})) return true;
  return false;
}

// FCL's distance query stops when an iteration gains less than this fraction of the sum of both parts' radii and the
// margin.
constexpr double kDistanceStep = 1e-10;

// The gap between two parts that do not touch. Their true distance is that of their nearest points.
struct Gap {
  double distance;  // found by FCL; never below the true distance
  Vector normal;    // unit vector along that distance, from a to b
  Vector middle;    // halfway between the two points that FCL found
  double at_least;  // a lower bound of the true distance
};

// The largest coordinate of a part along a direction: its support.
double support(const PosedPart& part, const Vector& along) {
  const Vector local = part.pose.linear().transpose() * along;
  const auto* const shape = static_cast<const fcl::ShapeBased*>(part.geometry());
  return along.dot(part.pose * fcl::detail::getSupport(shape, local));
}

// Returns whether FCL finds two parts apart, and writes their gap. FCL returns the distance between one point of each
// part. It is never below the true distance, but may exceed it by any amount. The distance between the supports of both
// parts along the same direction is never above the true distance, so it gives at_least.
bool find_gap(const PosedPart& a, const PosedPart& b, double margin, Gap* out) {
  fcl::DistanceRequestd request;
  request.enable_nearest_points = true;
  request.gjk_solver_type = fcl::GST_LIBCCD;
  request.distance_tolerance = kDistanceStep * (a.geometry()->aabb_radius + b.geometry()->aabb_radius + margin);
  try {
    fcl::DistanceResultd result;
    fcl::distance(a.geometry(), a.pose, b.geometry(), b.pose, request, result);
    const Vector &on_a = result.nearest_points[0], &on_b = result.nearest_points[1];
    const double length = (on_b - on_a).norm();
    if (!(result.min_distance > 0 && length > 0)) return false;
    out->distance = result.min_distance;
    out->normal = (on_b - on_a) / length;
    out->middle = 0.5 * (on_a + on_b);
    const double end_a = support(a, out->normal), end_b = -support(b, -out->normal);
    out->at_least = end_b - end_a - kGapRounding * (std::fabs(end_a) + std::fabs(end_b));
    return true;
  } catch (const std::exception&) { return false; }
}

}  // namespace

bool fcl_leaves_touch(const ExactLeaf& a, const ExactLeaf& b, float margin) {
  fcl::CollisionRequestd request;
  request.num_max_contacts = 1;
  request.enable_contact = false;
  request.gjk_solver_type = fcl::GST_LIBCCD;
  return visit_parts(a, b, [&](const PosedPart& part_a, const PosedPart& part_b) {
    if (margin > 0) {
      Gap gap;
      const double limit = static_cast<double>(margin);
      return !find_gap(part_a, part_b, limit, &gap) || !(gap.at_least > limit);
    }
    try {
      fcl::CollisionResultd result;
      return fcl::collide(part_a.geometry(), part_a.pose, part_b.geometry(), part_b.pose, request, result) > 0;
    } catch (const std::exception&) { return true; }
  });
}

Contact fcl_leaf_contact(const ExactLeaf& a, const ExactLeaf& b, float margin) {
  fcl::CollisionRequestd request;
  request.num_max_contacts = 1;
  request.enable_contact = true;
  request.gjk_solver_type = fcl::GST_LIBCCD;
  constexpr float kNone = -std::numeric_limits<float>::infinity();
  Contact deepest = {{0, 0, 0}, kNone, {0, 0, 0}};
  const auto keep = [&deepest](double depth, const Vector& normal, const Vector& point) {
    if (!(static_cast<float>(depth) > deepest.depth)) return;
    deepest.depth = static_cast<float>(depth);
    for (int c = 0; c < 3; ++c) {
      deepest.normal[c] = static_cast<float>(normal[c]);
      deepest.point[c] = static_cast<float>(point[c]);
    }
  };
  visit_parts(a, b, [&](const PosedPart& part_a, const PosedPart& part_b) {
    try {
      fcl::CollisionResultd result;
      fcl::collide(part_a.geometry(), part_a.pose, part_b.geometry(), part_b.pose, request, result);
      Gap gap;
      if (result.isCollision()) {
        const fcl::Contactd& contact = result.getContact(0);
        keep(contact.penetration_depth, contact.normal, contact.pos);
      } else if (margin > 0 && find_gap(part_a, part_b, static_cast<double>(margin), &gap)) {
        keep(-gap.distance, gap.normal, gap.middle);
      }
    } catch (const std::exception&) {}
    return false;
  });
  if (deepest.depth == kNone) deepest.depth = 0;
  return deepest;
}

}  // namespace cab
