// FCL: which states of a robot collide, by trees of the triangles of its meshes.
#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/collision_object.h>

#include <algorithm>
#include <memory>
#include <utility>

#include "perf/measure/peers/robot_geometry.h"
#include "perf/measure/peers/robot_setup.h"
#include "scenes/robot/kinematics.h"

namespace cab::perf {
namespace {

class FclRobot {
 public:
  FclRobot(const scenes::Robot& robot, const RobotPairs& pairs, const scenes::LeafTriangles& triangles)
      : robot_(robot), kinematics_(robot), poses_(kinematics_.pose_floats()) {
    for (std::size_t n = 0; n < robot.body.leaves.size(); ++n) {
      is_mesh_.push_back(!triangles[n].empty());
      objects_.emplace_back(is_mesh_[n] ? mesh_geometry(triangles[n]) : shape_geometry(part(n)));
    }
    for (const LinkPair& pair : pairs.tested)
      for (std::size_t a = 0; a < objects_.size(); ++a)
        for (std::size_t b = 0; b < objects_.size(); ++b)
          if (robot.body.leaves[a].link == pair.a && robot.body.leaves[b].link == pair.b) pairs_.emplace_back(a, b);
  }

  bool touches(const double* state) {
    kinematics_.write_poses({state, robot_.variables.size()}, poses_);
    for (std::size_t n = 0; n < objects_.size(); ++n) {
      objects_[n].setTransform(place_of(is_mesh_[n], part(n), poses_.data() + 7 * robot_.body.leaves[n].link));
      objects_[n].computeAABB();
    }
    return std::any_of(pairs_.begin(), pairs_.end(), [&](const auto& pair) {
      const fcl::CollisionObjectd &a = objects_[pair.first], &b = objects_[pair.second];
      fcl::CollisionResultd result;
      return a.getAABB().overlap(b.getAABB()) && fcl::collide(&a, &b, fcl::CollisionRequestd(), result) > 0;
    });
  }

 private:
  const ConvexPart& part(std::size_t leaf) const { return robot_.body.leaves[leaf].parts[0].shape; }

  const scenes::Robot& robot_;
  scenes::Kinematics kinematics_;
  std::vector<float> poses_;  // of one state
  std::vector<bool> is_mesh_;
  std::vector<fcl::CollisionObjectd> objects_;
  std::vector<std::pair<std::size_t, std::size_t>> pairs_;
};

}  // namespace

RobotSetup fcl_setup(const scenes::Robot& robot, const RobotPairs& pairs, const scenes::LeafTriangles& triangles) {
  const auto model = std::make_shared<FclRobot>(robot, pairs, triangles);
  return {"fcl triangles", "trees of triangles, in double: boxes along the axes, then pairs of links until one touches",
          [model, variables = robot.variables.size()](Span<const double> states, Span<std::uint8_t> touching) {
            for (std::size_t s = 0; s < touching.size; ++s) touching[s] = model->touches(states.data + s * variables);
          }};
}

}  // namespace cab::perf
