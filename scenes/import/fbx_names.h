// Names of nodes that an FBX file has more than once.
#pragma once

#include <string>
#include <vector>

namespace cab::scenes {

// The names that several models of an FBX file have, binary or text, each once, sorted. FBX tells models apart by
// numbers. assimp 5.2.5 tells bones and tracks apart by name, so those of all models of one name go to the first.
std::vector<std::string> repeated_fbx_names(const std::string& bytes);

}  // namespace cab::scenes
