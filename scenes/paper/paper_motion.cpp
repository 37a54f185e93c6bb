// What the paper's five scenes share: turning, tilting, posing, and adding links.
#include "scenes/paper/paper_motion.h"

#include <cmath>
#include <utility>

namespace cab::scenes {

Vec3 about(const Vec3& axis, const Vec3& v, double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  return c * v + s * cross(axis, v) + ((1 - c) * dot(axis, v)) * axis;
}

std::array<Vec3, 3> about(Vec3 axis, const std::array<Vec3, 3>& axes, double angle) {
  return {about(axis, axes[0], angle), about(axis, axes[1], angle), about(axis, axes[2], angle)};
}

BodyPose tilted(const BodyPose& pose, double tilt) {
  const Vec3 unscaled = {1, 2, .5};
  const Vec3 axis = (1 / length(unscaled)) * unscaled;
  return {about(axis, pose.center, tilt), about(axis, pose.axes, tilt)};
}

void append_pose(const BodyPose& pose, std::vector<float>& poses) {
  for (std::size_t row = 0; row < 3; ++row) {
    for (const Vec3& axis : pose.axes) poses.push_back(static_cast<float>(axis[row]));
    poses.push_back(static_cast<float>(pose.center[row]));
  }
}

void add_link(Character& character, const std::string& name, std::int32_t parent, const Vec3& half) {
  BodyLeaf leaf;
  leaf.link = static_cast<std::uint32_t>(character.link_parents.size());
  for (std::size_t k = 0; k < 3; ++k) {
    leaf.box.half[k] = static_cast<float>(half[k]);
    leaf.box.axis[k][k] = 1;
  }
  character.link_names.push_back(name);
  character.link_parents.push_back(parent);
  character.link_joints.insert(character.link_joints.end(), {-leaf.box.half[0], 0.0f, 0.0f});
  character.leaves.push_back(std::move(leaf));
}

ShapePart hull_part(std::vector<float> vertices) {
  ShapePart part;
  part.shape.kind = ShapeKind::kConvexHull;
  part.vertices = std::move(vertices);
  return part;
}

}  // namespace cab::scenes
