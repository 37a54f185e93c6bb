// Skeletons and motions from any file that assimp reads, except BVH.
#pragma once

#include "scenes/import/import.h"
#include "scenes/import/motion.h"

#include <memory>
#include <string>

struct aiScene;

namespace cab::scenes {

// The motion of all nodes of a scene that assimp read: an animation by its name or number, or the first one if the text
// is empty. It is sampled by the clock of scenes/import/scene_clock.h, linearly and by slerp. Without an animation the
// rest pose is the only frame. `path` is the file in messages. Throws ImportError.
Motion motion_of_scene(std::shared_ptr<const aiScene> scene, const std::string& path, const std::string& animation);

// The skeleton of a scene that assimp read, moved by its own motion, or by that of options.motion. Joints are those of
// scenes/import/scene_joints.h; `named_bones` are nodes that the file calls bones. Transforms above the root are
// applied. Nodes that the motion lacks keep their rest pose, and all nodes keep the scale of their own rest pose.
// Throws ImportError.
Skeleton skeleton_of_scene(const aiScene& scene, const std::string& path, const Motion& motion,
                           const ImportOptions& options, const std::vector<std::string>& named_bones = {});

}  // namespace cab::scenes
