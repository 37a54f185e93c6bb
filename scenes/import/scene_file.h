// Skeletons from any file that assimp reads, except BVH.
#pragma once

#include "scenes/import/import.h"

struct aiScene;

namespace cab::scenes {

// The skeleton and the first animation of a scene that assimp read. Joints are the nodes that are bones of any mesh,
// or, if no mesh has bones, the nodes that the first animation moves. All nodes between them are joints too, up to
// the one node above them all, which is the root. Transforms above the root are applied. The animation is sampled at
// the mean spacing of its densest track, from its first to its last key, linearly and by slerp; tracks of one key have
// no say in it. Without an animation the rest pose is the only frame, and the skeleton is static. Throws ImportError.
Skeleton skeleton_of_scene(const aiScene& scene, const std::string& path, const ImportOptions& options);

}  // namespace cab::scenes
