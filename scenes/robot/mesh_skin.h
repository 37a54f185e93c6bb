// Meshes of a robot as a skin, for the makers of bodies from skins.
#pragma once

#include <cab/skin.h>

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

namespace cab::scenes {

// Meshes as a skin: each joint is a bone, and all have the frame of the skin.
struct MeshSkin {
  std::vector<std::int32_t> parents;
  std::vector<float> frames;  // of joints, and their inverses
  std::vector<float> vertices, weights;
  std::vector<std::uint32_t> bones, triangles;
  std::vector<std::uint32_t> leaf_of;  // by triangle: the robot's leaf that is its mesh

  explicit MeshSkin(std::vector<std::int32_t> joint_parents) : parents(std::move(joint_parents)) {
    for (std::size_t l = 0; l < parents.size(); ++l)
      for (std::size_t i = 0; i < 16; ++i) frames.push_back(i % 5 == 0 ? 1.0f : 0.0f);
  }

  void add_mesh(std::uint32_t leaf, std::uint32_t joint, const std::vector<float>& corners) {
    const auto first = static_cast<std::uint32_t>(vertices.size() / 3);
    const auto count = static_cast<std::uint32_t>(corners.size() / 3);
    vertices.insert(vertices.end(), corners.begin(), corners.end());
    bones.insert(bones.end(), count, joint);
    weights.insert(weights.end(), count, 1.0f);
    for (std::uint32_t v = 0; v < count; ++v) triangles.push_back(first + v);
    leaf_of.insert(leaf_of.end(), count / 3, leaf);
  }

  rig::Skin skin() const {
    rig::Skin skin;
    skin.joint_parents = parents;
    skin.poses = frames;
    skin.vertices = vertices;
    skin.triangles = triangles;
    skin.influence_count = 1;
    skin.influence_bones = bones;
    skin.influence_weights = weights;
    skin.inverse_bind = frames;
    return skin;
  }
};

// Whether a triangle of a mesh, of which corners has x y z of three corners each, has three different corners.
inline bool has_triangle(const std::vector<float>& corners) {
  for (std::size_t t = 0; t < corners.size(); t += 9) {
    const float* const at = corners.data() + t;
    if (!std::equal(at, at + 3, at + 3) && !std::equal(at + 3, at + 6, at + 6) && !std::equal(at, at + 3, at + 6))
      return true;
  }
  return false;
}

}  // namespace cab::scenes
