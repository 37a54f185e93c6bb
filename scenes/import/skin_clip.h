// A character of bodies that are made of a file's meshes.
#pragma once

#include <cab/skin.h>

#include <string>
#include <vector>

#include "scenes/import/import.h"

namespace cab::scenes {

// A skeleton's meshes as rig::Skin in all frames, relative to the place of the root joint. The spans are of the
// skeleton and of `poses`, which is written.
rig::Skin skin_of(const Skeleton& skeleton, std::vector<float>& poses);

// Makes links and leaves of a skeleton's meshes by rig::bodies_from_skin with the coverage, or by
// rig::surface_from_skin, and poses for every frame. The first frame is the rest pose. Links have the names of their
// joints. Poses are relative to the root joint, as those of make_clip. Throws ImportError.
void add_skin_bodies(const Skeleton& skeleton, const std::string& name, const ImportOptions& options, Clip& clip);

}  // namespace cab::scenes
