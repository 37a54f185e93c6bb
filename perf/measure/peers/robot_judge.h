// The judge of `cab peers --robot`: which links touch by the triangles of their meshes, not by hulls of these.
#pragma once

#include <cstdint>
#include <vector>

#include "perf/judge/oracle/convex_pairs.h"
#include "perf/judge/oracle/touching_triangles.h"
#include "perf/measure/peers/robot_geometry.h"
#include "scenes/robot/robot.h"

namespace cab::perf {

// How two links touch, in order.
enum class RobotTouch : std::uint8_t {
  kApart,
  kInside,   // a shape is inside a mesh, and meets no triangle of it
  kSurface,  // triangles touch, or triangles and solids, or solids
};

// A mesh touches another one if two of their triangles do, by brute force (perf/judge/oracle/touching_triangles.h).
// Against another shape, a mesh is its triangles and the shape is solid, by FCL in double. What meets no triangle of a
// mesh is inside if the mesh winds about the first corner of the other mesh, or about the middle of the other shape.
// Two shapes that are no meshes are judged as convex bodies by perf/judge/oracle.
class RobotJudge {
 public:
  RobotJudge(const scenes::Robot& robot, const scenes::LeafTriangles& triangles);

  // How two links touch. poses: of all links in one state, 7 numbers each.
  RobotTouch touch(const std::vector<float>& poses, std::uint32_t link_a, std::uint32_t link_b) const;

 private:
  struct JudgedLeaf {
    oracle::PosedPart part;
    RobotGeometry geometry;
    std::vector<float> corners;  // of triangles; empty: it is no mesh
    bool is_mesh() const { return !corners.empty(); }
  };

  static RobotTouch touch(const JudgedLeaf& a, const JudgedLeaf& b, const float* pose_a, const float* pose_b);

  std::vector<std::vector<JudgedLeaf>> leaves_;  // of each link
};

}  // namespace cab::perf
