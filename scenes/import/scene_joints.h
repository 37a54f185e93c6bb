// Which nodes of a scene that assimp read are joints.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "scenes/affine.h"

struct aiNode;
struct aiScene;
struct aiString;

namespace cab::scenes {

// The nodes of a scene in pre-order, and their parents.
struct NodeTree {
  std::vector<const aiNode*> nodes;
  std::vector<std::int32_t> parents;                        // -1 of the first
  std::vector<std::size_t> ends;                            // [node] the first node after it that is not below it
  std::unordered_map<std::string_view, std::size_t> named;  // borrows the names of the nodes

  bool is_at_or_below(std::size_t node, std::size_t top) const { return node >= top && node < ends[top]; }
};

std::string_view view(const aiString& name);

// Whether all numbers of a transform are finite and in the range of import.
bool is_usable(const Affine& transform);

// Lists all nodes. A name may belong to several nodes (a bone and the mesh that it moves). Then it means the first node
// without a mesh, or the first node if all have meshes. `path` is the file in messages. Throws ImportError.
NodeTree tree_of(const aiScene& scene, const std::string& path);

// What says which nodes are joints, besides the scene.
struct JointHints {
  std::vector<bool> has_track;           // [node]
  std::vector<std::string> named_bones;  // nodes that the file calls bones, by name
  bool with_meshes = false;              // meshes without bones count, since bodies are made of meshes
};

// [node] whether it is a joint; empty if none is.
//
// Joints are the bones of all meshes, the nodes that the file calls bones, the nodes with tracks, what is below these,
// and what connects them up to the one node above them all. Where there are bones, a node with a track counts if it is
// below the one node above all bones, or above that and no mere container, or in a chain of nodes that hangs from a
// node above. Never joints, unless they are bones or connect joints: cameras and lights, nodes with meshes (but see
// with_meshes), and helpers by name (is_helper in scenes/rig/body_parts.h). Where only the file's own word makes bones,
// nothing below them is added.
std::vector<bool> choose_joints(const aiScene& scene, const NodeTree& tree, const JointHints& hints);

// [node] whether it is no joint, though it has a track that the joints do not show: it is not above all joints, and no
// camera, light, or mesh that bones move.
std::vector<bool> left_out_nodes(const aiScene& scene, const NodeTree& tree, const std::vector<bool>& has_track,
                                 const std::vector<bool>& is_joint);

}  // namespace cab::scenes
