// Poses of glTF: the joints of a skin in an order in which parents come first, and the matrices of their nodes.
#pragma once

#include <cab/cab.h>

#include <algorithm>
#include <cstdint>
#include <vector>

namespace as_in_gltf {

// A node as it is in the file, or as an animation has set it: the quaternion is x y z w.
struct Node {
  std::int32_t parent;  // index of the node whose child this is, or -1
  float translation[3];
  float rotation[4];
  float scale[3];
};

// The links of an articulation: each joint of a skin is one.
struct Links {
  std::vector<std::uint32_t> nodes;   // the node of each link
  std::vector<std::int32_t> parents;  // for ArticulationDesc::link_parents
};

// joints: of the skin, in any order, as in the file.
inline Links links_of(const std::vector<Node>& nodes, std::vector<std::uint32_t> joints) {
  const auto depth = [&](std::uint32_t node) {
    int ancestors = 0;
    for (std::int32_t n = nodes[node].parent; n >= 0; n = nodes[static_cast<std::uint32_t>(n)].parent) ++ancestors;
    return ancestors;
  };
  std::stable_sort(joints.begin(), joints.end(), [&](std::uint32_t a, std::uint32_t b) { return depth(a) < depth(b); });
  Links links = {joints, {}};
  for (const std::uint32_t joint : joints) {  // the parent is the nearest node above that is a joint
    std::int32_t parent = -1;
    for (std::int32_t n = nodes[joint].parent; n >= 0 && parent < 0; n = nodes[static_cast<std::uint32_t>(n)].parent) {
      const auto at = std::find(joints.begin(), joints.end(), static_cast<std::uint32_t>(n));
      if (at != joints.end()) parent = static_cast<std::int32_t>(at - joints.begin());
    }
    links.parents.push_back(parent);
  }
  return links;
}

// A node's matrix: translation * rotation * scale. By columns, as all matrices of glTF are.
inline void set_local(const Node& node, float* m) {
  const float x = node.rotation[0], y = node.rotation[1], z = node.rotation[2], w = node.rotation[3];
  const float axes[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)},
                            {2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)},
                            {2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)}};
  for (int column = 0; column < 3; ++column) {
    for (int row = 0; row < 3; ++row) m[4 * column + row] = node.scale[column] * axes[column][row];
    m[4 * column + 3] = 0;
    m[12 + column] = node.translation[column];
  }
  m[15] = 1;
}

// quote
// The pose of a link, 16 floats: the matrix of its node times those of all nodes above, joints or not.
inline void set_pose(const std::vector<Node>& nodes, std::uint32_t node, float* pose) {
  set_local(nodes[node], pose);
  for (std::int32_t n = nodes[node].parent; n >= 0; n = nodes[static_cast<std::uint32_t>(n)].parent) {
    float parent[16], product[16] = {};
    set_local(nodes[static_cast<std::uint32_t>(n)], parent);
    for (int i = 0; i < 16; ++i)
      for (int k = 0; k < 4; ++k) product[i] += parent[4 * k + i % 4] * pose[i / 4 * 4 + k];
    std::copy(product, product + 16, pose);
  }
}

inline cab::PoseView poses_of(const std::vector<float>& matrices) {
  cab::PoseView poses;
  poses.format = cab::PoseFormat::kMatrix4x4Columns;
  poses.data = matrices.data();
  poses.has_scale = true;  // of nodes, the same along all axes
  return poses;
}
// end quote

}  // namespace as_in_gltf
