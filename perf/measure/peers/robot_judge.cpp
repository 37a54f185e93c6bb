#include "perf/measure/peers/robot_judge.h"

#include <fcl/narrowphase/collision.h>

#include <algorithm>

namespace cab::perf {
namespace {

fcl::Vector3d point(const std::vector<float>& corners, std::size_t at) {
  return {corners[at], corners[at + 1], corners[at + 2]};
}

oracle::TriangleSet placed(const std::vector<float>& corners, const fcl::Transform3d& place) {
  std::vector<oracle::Triangle<double>> triangles(corners.size() / 9);
  for (std::size_t v = 0; v < corners.size() / 3; ++v) {
    const fcl::Vector3d at = place * point(corners, 3 * v);
    triangles[v / 3].corner[v % 3] = {{at[0], at[1], at[2]}};
  }
  return oracle::TriangleSet(std::move(triangles));
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
                                  triangles[n].empty() ? shape_geometry(part) : mesh_geometry(triangles[n]),
                                  triangles[n]});
  }
}

RobotTouch RobotJudge::touch(const JudgedLeaf& a, const JudgedLeaf& b, const float* pose_a, const float* pose_b) {
  if (!a.is_mesh() && !b.is_mesh()) {
    oracle::ConvexCase made = {a.part, b.part, {}};
    std::copy_n(pose_a, 7, made.a.pose);
    std::copy_n(pose_b, 7, made.b.pose);
    bind_vertices(made);
    return are_apart(judge_case(made, oracle::Effort::kDecide).verdict) ? RobotTouch::kApart : RobotTouch::kSurface;
  }
  const fcl::Transform3d place_a = place_of(a.is_mesh(), a.part.part, pose_a),
                         place_b = place_of(b.is_mesh(), b.part.part, pose_b);
  if (a.is_mesh() && b.is_mesh()) {
    if (any_touch(placed(a.corners, place_a), placed(b.corners, place_b))) return RobotTouch::kSurface;
  } else {
    fcl::CollisionResultd result;
    if (fcl::collide(a.geometry.get(), place_a, b.geometry.get(), place_b, fcl::CollisionRequestd(), result) > 0)
      return RobotTouch::kSurface;
  }
  const auto is_inside = [](const JudgedLeaf& inner, const JudgedLeaf& outer, const fcl::Transform3d& to_outer) {
    const fcl::Vector3d in = inner.is_mesh() ? point(inner.corners, 0) : fcl::Vector3d::Zero();
    return outer.is_mesh() && winding(outer.corners, to_outer * in) != 0;
  };
  return is_inside(a, b, place_b.inverse() * place_a) || is_inside(b, a, place_a.inverse() * place_b)
             ? RobotTouch::kInside
             : RobotTouch::kApart;
}

RobotTouch RobotJudge::touch(const std::vector<float>& poses, std::uint32_t link_a, std::uint32_t link_b) const {
  RobotTouch most = RobotTouch::kApart;
  for (const JudgedLeaf& a : leaves_[link_a])
    for (const JudgedLeaf& b : leaves_[link_b])
      if (most != RobotTouch::kSurface)
        most = std::max(most, touch(a, b, poses.data() + 7 * link_a, poses.data() + 7 * link_b));
  return most;
}

}  // namespace cab::perf
