// The container and the JSON of a glTF file.
#include "scenes/import/gltf_file.h"

#include "scenes/import/gltf_document.h"
#include "scenes/import/gltf_rewrite.h"
#include "scenes/import/import.h"

#include <algorithm>
#include <cstdint>
#include <string_view>

namespace cab::scenes {
namespace {

constexpr const char* kMagic = "glTF";
constexpr std::uint32_t kJsonChunk = 0x4e4f534a;  // "JSON"
constexpr std::uint32_t kBinChunk = 0x004e4942;   // "BIN"
constexpr std::size_t kHeaderBytes = 12;
constexpr std::size_t kChunkHeaderBytes = 8;
constexpr std::size_t kVersion1HeaderBytes = 20;
constexpr int kMaxJsonDepth = 256;  // assimp's parser calls itself for each level

std::uint32_t word(const std::string& bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t k = 4; k-- > 0;) value = value << 8 | static_cast<unsigned char>(bytes[at + k]);
  return value;
}

// Where the parts of a file are. A glTF that is no GLB is JSON only.
struct Parts {
  std::string_view json;
  std::optional<std::string_view> bin;
};

Parts glb_parts(const std::string& bytes, const std::string& name) {
  const auto fail = [&name](const std::string& reason) { throw ImportError(name + ": " + reason); };
  if (bytes.size() < kHeaderBytes) fail("the file ends in the header of the GLB");
  const std::uint32_t version = word(bytes, 4), length = word(bytes, 8);
  if (version != 1 && version != 2) fail("GLB version " + std::to_string(version) + ", only 1 and 2 are supported");
  if (length > bytes.size())
    fail("the header of the GLB says " + std::to_string(length) + " bytes, the file has " +
         std::to_string(bytes.size()));
  Parts parts;
  if (version == 1) {
    if (length < kVersion1HeaderBytes) fail("the file ends in the header of the GLB");
    const std::uint32_t json_bytes = word(bytes, 12);
    if (word(bytes, 16) != 0) fail("the content of the GLB is not JSON");
    if (json_bytes > length - kVersion1HeaderBytes)
      fail("the JSON of the GLB has " + std::to_string(json_bytes) + " bytes, more than the file");
    parts.json = std::string_view(bytes).substr(kVersion1HeaderBytes, json_bytes);
    parts.bin =
        std::string_view(bytes).substr(kVersion1HeaderBytes + json_bytes, length - kVersion1HeaderBytes - json_bytes);
    return parts;
  }
  std::size_t at = kHeaderBytes;
  for (std::size_t chunk = 0; at < length; ++chunk) {
    const std::string which = "chunk " + std::to_string(chunk) + " of the GLB ";
    if (length - at < kChunkHeaderBytes) fail(which + "ends in its header");
    const std::uint32_t chunk_bytes = word(bytes, at), type = word(bytes, at + 4);
    at += kChunkHeaderBytes;
    if (chunk_bytes > length - at)
      fail(which + "has " + std::to_string(chunk_bytes) + " bytes, but only " + std::to_string(length - at) +
           " are left");
    if (chunk == 0 && type != kJsonChunk) fail(which + "is not JSON");
    if (chunk == 0) parts.json = std::string_view(bytes).substr(at, chunk_bytes);
    if (chunk == 1 && type == kBinChunk) parts.bin = std::string_view(bytes).substr(at, chunk_bytes);
    at += std::min<std::size_t>((chunk_bytes + std::size_t{3}) / 4 * 4, length - at);
  }
  if (parts.json.empty()) fail("the GLB has no JSON");
  return parts;
}

bool is_glb(const std::string& bytes) { return bytes.rfind(kMagic, 0) == 0; }

Parts parts_of(const std::string& bytes, const std::string& name) {
  return is_glb(bytes) ? glb_parts(bytes, name) : Parts{bytes, {}};
}

// How deep arrays and objects are nested in a text, also if it is not JSON to its end.
int nesting(std::string_view text) {
  int depth = 0, deepest = 0;
  bool in_string = false;
  for (std::size_t at = 0; at < text.size(); ++at) {
    const char c = text[at];
    if (in_string && c == '\\') ++at;
    if (c == '"') in_string = !in_string;
    if (in_string) continue;
    if (c == '[' || c == '{') deepest = std::max(deepest, ++depth);
    if (c == ']' || c == '}') --depth;
  }
  return deepest;
}

GltfDocument::Json parse_json(std::string_view text, const std::string& name) {
  // Some writers fill the JSON of a GLB up with zeros, not with blanks.
  while (!text.empty() && text.back() == '\0') text.remove_suffix(1);
  if (nesting(text) > kMaxJsonDepth)
    throw ImportError(name + ": its JSON is nested more than " + std::to_string(kMaxJsonDepth) + " deep");
  using Json = GltfDocument::Json;
  try {
    Json json = Json::parse(text.begin(), text.end());
    if (json.is_object()) return json;
  } catch (const Json::parse_error& error) {
    throw ImportError(name + ": its JSON is broken at byte " + std::to_string(error.byte));
  } catch (const Json::exception&) { throw ImportError(name + ": its JSON has a number that is out of range"); }
  throw ImportError(name + ": its JSON is not an object");
}

}  // namespace

bool is_gltf(const std::string& extension, const std::string& first_bytes) {
  return extension == ".gltf" || extension == ".glb" || extension == ".vrm" || first_bytes.rfind(kMagic, 0) == 0;
}

std::vector<std::filesystem::path> gltf_buffer_files(const std::string& bytes, const std::string& name) {
  const GltfDocument::Json json = parse_json(parts_of(bytes, name).json, name);
  const auto buffers = json.find("buffers");
  std::vector<std::filesystem::path> files;
  if (buffers == json.end()) return files;
  for (const GltfDocument::Json& buffer : *buffers) {
    const auto uri = buffer.is_object() ? buffer.find("uri") : buffer.end();
    if (uri == buffer.end() || !uri->is_string()) continue;
    const std::string& text = uri->get_ref<const std::string&>();
    const std::optional<std::filesystem::path> file = text.rfind("data:", 0) == 0 ? std::nullopt : path_of_uri(text);
    if (file && std::find(files.begin(), files.end(), *file) == files.end()) files.push_back(*file);
  }
  return files;
}

GltfForAssimp prepare_gltf(const std::string& bytes, const std::string& path, const std::string& name) {
  GltfForAssimp prepared;
  prepared.is_binary = is_glb(bytes);
  const Parts parts = parts_of(bytes, name);
  GltfDocument document(parse_json(parts.json, name), parts.bin, std::filesystem::path(path).parent_path(), name);
  document.check();
  if (!document.is_version_1()) prepared.glb = rewrite_gltf(document, prepared.notes, prepared.bones);
  return prepared;
}

}  // namespace cab::scenes
