// Files that assimp reads, but for what it would read wrong.
#pragma once

#include <string>
#include <vector>

struct aiScene;

namespace Assimp {
class Importer;
}

namespace cab::scenes {

// What a file says besides what assimp reads.
struct FileFacts {
  std::vector<std::string> notes;           // what the user may not expect
  std::vector<std::string> named_bones;     // nodes that the file calls bones, by the names that assimp gives them
  std::vector<std::string> repeated_names;  // that several nodes have, whose bones and tracks all go to the first
};

// importer.ReadFile(path), but glTF files of version 2 (gltf_file.h) and Collada files (collada_file.h) are prepared
// first. Returns what assimp returns, which is nullptr if it cannot read the file. `name` is the file in messages;
// `facts` are added to. Throws ImportError for a glTF file that does not pass its checks, and what
// assimp throws.
const aiScene* read_prepared(Assimp::Importer& importer, const std::string& path, const std::string& name,
                             FileFacts& facts);

}  // namespace cab::scenes
