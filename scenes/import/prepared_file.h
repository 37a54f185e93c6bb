// Files that assimp reads, but for what it would read wrong.
#pragma once

#include <string>
#include <vector>

struct aiScene;

namespace Assimp {
class Importer;
}

namespace cab::scenes {

// importer.ReadFile(path), but glTF files of version 2 (gltf_file.h) and Collada files (collada_file.h) are prepared
// first. Returns what assimp returns, which is nullptr if it cannot read the file. `name` is the file in messages;
// notes get what the user may not expect. Throws ImportError for a glTF file that does not pass its checks, and what
// assimp throws.
const aiScene* read_prepared(Assimp::Importer& importer, const std::string& path, const std::string& name,
                             std::vector<std::string>& notes);

}  // namespace cab::scenes
