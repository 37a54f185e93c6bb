// A character of a scene as the judges of perf/judge/oracle read it.
#pragma once

#include <cstdint>
#include <vector>

#include "perf/judge/oracle/exact_pose.h"
#include "scenes/scene.h"

namespace cab::perf {

// Leaf boxes and poses of a character. Frames are those of the scene; a static character has
// the same poses in all of them.
struct JudgedCharacter {
  oracle::Rig rig;
  oracle::Poses poses;
  bool is_static;

  explicit JudgedCharacter(const scenes::Character& character) : is_static(character.is_static) {
    for (const scenes::BodyLeaf& leaf : character.leaves) rig.leaves.push_back({leaf.link, leaf.box, {}});
    poses.format = character.pose_format;
    poses.link_count = static_cast<std::uint32_t>(character.link_parents.size());
    poses.data = character.poses;
    poses.origins = character.origins;
  }
  std::vector<oracle::ExactBox> boxes(std::uint32_t frame) const {
    return oracle::exact_leaf_boxes(rig, poses, is_static ? 0 : frame);
  }
  oracle::ExactPose pose(std::uint32_t frame, std::uint32_t link) const {
    return oracle::exact_pose(poses, is_static ? 0 : frame, link);
  }
  oracle::Point origin(std::uint32_t frame) const { return oracle::exact_origin(poses, is_static ? 0 : frame); }
};

}  // namespace cab::perf
