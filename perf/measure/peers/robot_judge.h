// The judge of `cab peers --robot`: which links touch by the triangles of their meshes, not by hulls of these.
#pragma once

#include <fcl/common/types.h>
#include <fcl/geometry/collision_geometry.h>

#include <cstdint>
#include <memory>
#include <vector>

#include "perf/judge/oracle/convex_pairs.h"
#include "scenes/robot/robot.h"

namespace cab::perf {

// A mesh touches another one if two of their triangles do, by FCL in double. Against another shape, a mesh is its
// triangles and the shape is solid, by FCL too. What meets no triangle of a mesh touches it if it is inside: if the
// mesh winds about the first corner of the other mesh, or about the middle of the other shape. Two shapes that are no
// meshes are judged as convex bodies by perf/judge/oracle.
class RobotJudge {
 public:
  RobotJudge(const scenes::Robot& robot, const scenes::LeafTriangles& triangles);

  // Whether two links touch. poses: of all links in one state, 7 numbers each.
  bool touch(const std::vector<float>& poses, std::uint32_t link_a, std::uint32_t link_b) const;

 private:
  struct JudgedLeaf {
    oracle::PosedPart part;
    std::shared_ptr<fcl::CollisionGeometryd> geometry;
    std::vector<float> corners;  // of triangles; empty: it is no mesh
    bool is_mesh() const { return !corners.empty(); }
  };

  static fcl::Transform3d place(const JudgedLeaf& leaf, const float* pose);
  static bool touch(const JudgedLeaf& a, const JudgedLeaf& b, const float* pose_a, const float* pose_b);

  std::vector<std::vector<JudgedLeaf>> leaves_;  // of each link
};

}  // namespace cab::perf
