// Meshes, weights and inverse bind matrices of any file that assimp reads, except BVH.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include <assimp/matrix4x4.h>

#include "scenes/affine.h"
#include "scenes/import/import.h"

struct aiNode;
struct aiScene;
struct aiString;

namespace cab::scenes {

// The nodes of a scene in pre-order, and which of them are joints. All members are borrowed.
struct SceneNodes {
  const std::vector<const aiNode*>& nodes;
  const std::vector<std::int32_t>& parents;                    // -1 of the first node
  const std::vector<std::int32_t>& joint_of;                   // [node] or -1
  const std::function<std::int32_t(const aiString&)> node_of;  // the node that a bone's name means, or -1
};

Affine affine(const aiMatrix4x4& matrix);

// Reads all meshes into skeleton.skin. A mesh with bones is moved by them. A mesh without bones is moved by the joint
// at or above its node; if there is none, it is left out, with a note. Throws ImportError, also for a
// negative weight.
void read_skin(const aiScene& scene, const SceneNodes& nodes, const std::string& path, double metres_per_unit,
               Skeleton& skeleton);

}  // namespace cab::scenes
