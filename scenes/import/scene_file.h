// Skeletons and motions from any file that assimp reads, except BVH.
#pragma once

#include "scenes/import/import.h"
#include "scenes/import/motion.h"

#include <memory>
#include <string>

struct aiScene;

namespace cab::scenes {

// The motion of all nodes of a scene that assimp read: an animation by its name or number, or the first one if the text
// is empty. It is sampled at the mean spacing of its densest track, from its first to its last key, linearly and by
// slerp; tracks of one key have no say in it. Without an animation the rest pose is the only frame. `path` is the file
// in messages. Throws ImportError.
Motion motion_of_scene(std::shared_ptr<const aiScene> scene, const std::string& path, const std::string& animation);

// The skeleton of a scene that assimp read, moved by its own motion, or by that of options.motion. Joints are the nodes
// that are bones of any mesh, or, if no mesh has bones, the nodes that the motion moves. All nodes between them are
// joints too, up to the one node above them all, which is the root. Transforms above the root are applied. Nodes that
// the motion lacks keep their rest pose. With one frame the skeleton is static. Throws ImportError.
Skeleton skeleton_of_scene(const aiScene& scene, const std::string& path, const Motion& motion,
                           const ImportOptions& options);

}  // namespace cab::scenes
