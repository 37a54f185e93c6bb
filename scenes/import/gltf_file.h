// A glTF file on its way to assimp: GLB header and chunks, JSON, every offset and count in it are checked, and what
// assimp 5.2.5 would read wrong is written anew.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace cab::scenes {

// True for the extensions .gltf, .glb and .vrm, in lower case, and for a file that begins as a GLB does.
bool is_gltf(const std::string& extension, const std::string& first_bytes);

// The path below a file's folder that a URI in the file names, with its percent-encoding (RFC 3986) decoded; nothing if
// that is malformed or if the path leaves the folder.
std::optional<std::filesystem::path> path_of_uri(const std::string& uri);

// What assimp gets instead of a file.
struct GltfForAssimp {
  bool is_binary = false;          // whether the file is a GLB
  std::string glb;                 // a file of version 2 written anew (gltf_rewrite.h); empty: assimp gets the file
  std::vector<std::string> notes;  // what the GLB has otherwise than the file
  std::vector<std::string> bones;  // nodes of the GLB that the file calls bones
};

// Checks the bytes of a glTF file of version 1 or 2:
// - a GLB's version, length and chunks lie in the file;
// - the JSON is well-formed and not deep, and no extension is required but those that are known;
// - buffers are not larger than what holds them, and lie in the file, in its JSON, or in files by path_of_uri;
// - buffer views lie in their buffers and accessors in their views; numbers are whole and not negative;
// - nodes are trees, not deep; skins and animations name nodes and accessors that exist, of the right type and size.
// `path` is where the file is, for files that it names. `name` is the file in messages. Throws ImportError.
GltfForAssimp prepare_gltf(const std::string& bytes, const std::string& path, const std::string& name);

// The files that the buffers of a glTF file name, from its folder on: those of path_of_uri, each once. Throws
// ImportError if the GLB or its JSON is broken.
std::vector<std::filesystem::path> gltf_buffer_files(const std::string& bytes, const std::string& name);

}  // namespace cab::scenes
