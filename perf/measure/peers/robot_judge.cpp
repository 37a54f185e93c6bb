#include "perf/measure/peers/robot_judge.h"

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/cylinder.h>
#include <fcl/geometry/shape/ellipsoid.h>
#include <fcl/geometry/shape/sphere.h>
#include <fcl/math/bv/OBBRSS.h>
#include <fcl/narrowphase/collision.h>

#include <algorithm>

namespace cab::perf {
namespace {

using Geometry = std::shared_ptr<fcl::CollisionGeometryd>;

fcl::Vector3d point(const std::vector<float>& corners, std::size_t at) {
  return {corners[at], corners[at + 1], corners[at + 2]};
}

Geometry mesh_of(const std::vector<float>& corners) {
  const auto mesh = std::make_shared<fcl::BVHModel<fcl::OBBRSSd>>();
  mesh->beginModel(static_cast<int>(corners.size() / 9));
  for (std::size_t t = 0; t < corners.size(); t += 9)
    mesh->addTriangle(point(corners, t), point(corners, t + 3), point(corners, t + 6));
  mesh->endModel();
  return mesh;
}

Geometry shape_of(const ConvexPart& part) {
  const double x = part.size[0], y = part.size[1], z = part.size[2];
  switch (part.kind) {
    case ShapeKind::kSphere: return std::make_shared<fcl::Sphered>(x);
    case ShapeKind::kCapsule: return std::make_shared<fcl::Capsuled>(x, 2 * y);
    case ShapeKind::kCylinder: return std::make_shared<fcl::Cylinderd>(x, 2 * y);
    case ShapeKind::kEllipsoid: return std::make_shared<fcl::Ellipsoidd>(x, y, z);
    default: return std::make_shared<fcl::Boxd>(2 * x, 2 * y, 2 * z);
  }
}

fcl::Transform3d motion(const float* rotation, const float* translation) {
  const fcl::Quaterniond q(rotation[3], rotation[0], rotation[1], rotation[2]);
  fcl::Transform3d out = fcl::Transform3d::Identity();
  out.linear() = q.normalized().toRotationMatrix();
  out.translation() = fcl::Vector3d(translation[0], translation[1], translation[2]);
  return out;
}

// How often the surface of a mesh winds about a point, which is not 0 inside: its signed crossings of a ray.
int winding(const std::vector<float>& corners, const fcl::Vector3d& about) {
  const fcl::Vector3d ray(.5337, .6421, .5503);  // of any direction but along edges of usual meshes
  int count = 0;
  for (std::size_t t = 0; t < corners.size(); t += 9) {
    const fcl::Vector3d a = point(corners, t) - about, b = point(corners, t + 3) - about,
                        c = point(corners, t + 6) - about;
    const double ab = ray.dot(a.cross(b)), bc = ray.dot(b.cross(c)), ca = ray.dot(c.cross(a));
    if ((ab > 0) != (bc > 0) || (bc > 0) != (ca > 0)) continue;
    const bool is_left = ab > 0;
    if ((a.dot(b.cross(c)) > 0) == is_left) count += is_left ? 1 : -1;
  }
  return count;
}

}  // namespace

RobotJudge::RobotJudge(const scenes::Robot& robot, const scenes::LeafTriangles& triangles)
    : leaves_(robot.links.size()) {
  for (std::size_t n = 0; n < robot.body.leaves.size(); ++n) {
    const scenes::BodyLeaf& leaf = robot.body.leaves[n];
    const ConvexPart& part = leaf.parts[0].shape;
    leaves_[leaf.link].push_back({{part, leaf.parts[0].vertices, {}},
                                  triangles[n].empty() ? shape_of(part) : mesh_of(triangles[n]),
                                  triangles[n]});
  }
}

fcl::Transform3d RobotJudge::place(const JudgedLeaf& leaf, const float* pose) {
  const fcl::Transform3d link = motion(pose, pose + 4);
  return leaf.is_mesh() ? link : fcl::Transform3d(link * motion(leaf.part.part.rotation, leaf.part.part.position));
}

bool RobotJudge::touch(const JudgedLeaf& a, const JudgedLeaf& b, const float* pose_a, const float* pose_b) {
  if (!a.is_mesh() && !b.is_mesh()) {
    oracle::ConvexCase made = {a.part, b.part, {}};
    std::copy_n(pose_a, 7, made.a.pose);
    std::copy_n(pose_b, 7, made.b.pose);
    bind_vertices(made);
    return !are_apart(judge_case(made, oracle::Effort::kDecide).verdict);
  }
  const fcl::Transform3d place_a = place(a, pose_a), place_b = place(b, pose_b);
  fcl::CollisionResultd result;
  if (fcl::collide(a.geometry.get(), place_a, b.geometry.get(), place_b, fcl::CollisionRequestd(), result) > 0)
    return true;
  const auto is_inside = [](const JudgedLeaf& inner, const JudgedLeaf& outer, const fcl::Transform3d& to_outer) {
    const fcl::Vector3d in = inner.is_mesh() ? point(inner.corners, 0) : fcl::Vector3d::Zero();
    return outer.is_mesh() && winding(outer.corners, to_outer * in) != 0;
  };
  return is_inside(a, b, place_b.inverse() * place_a) || is_inside(b, a, place_a.inverse() * place_b);
}

bool RobotJudge::touch(const std::vector<float>& poses, std::uint32_t link_a, std::uint32_t link_b) const {
  for (const JudgedLeaf& a : leaves_[link_a])
    for (const JudgedLeaf& b : leaves_[link_b])
      if (touch(a, b, poses.data() + 7 * link_a, poses.data() + 7 * link_b)) return true;
  return false;
}

}  // namespace cab::perf
