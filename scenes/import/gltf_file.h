// The check of a glTF file before assimp sees it: GLB header and chunks, JSON, and every offset and count in it.
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

// Checks the bytes of a glTF file of version 1 or 2:
// - a GLB's version, length and chunks lie in the file;
// - the JSON is well-formed and not deep, and needs no extension that compresses;
// - buffers are not larger than what holds them, and lie in the file, in its JSON, or in files by path_of_uri;
// - buffer views lie in their buffers and accessors in their views; numbers are whole and not negative;
// - nodes are trees, not deep; skins and animations name nodes and accessors that exist, of the right type and size.
// `path` is where the file is, for files that it names. `name` is the file in messages. Returns whether it is a GLB.
// Throws ImportError.
bool check_gltf(const std::string& bytes, const std::string& path, const std::string& name);

// The files that the buffers of a glTF file name, from its folder on: those of path_of_uri, each once. Throws
// ImportError if the GLB or its JSON is broken.
std::vector<std::filesystem::path> gltf_buffer_files(const std::string& bytes, const std::string& name);

}  // namespace cab::scenes
