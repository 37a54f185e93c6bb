// Reads the humanoid of a VRM file.
#include "scenes/import/vrm_bones.h"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

namespace cab::scenes {
namespace {

using Json = nlohmann::json;

// The value at a path of keys, or null.
const Json& at_path(const Json& json, std::initializer_list<const char*> keys) {
  static const Json none;
  const Json* value = &json;
  for (const char* key : keys) {
    if (!value->is_object()) return none;
    const auto found = value->find(key);
    if (found == value->end()) return none;
    value = &*found;
  }
  return *value;
}

}  // namespace

std::string_view json_of_gltf(const std::string& bytes, bool is_glb) {
  constexpr std::size_t kHeader = 12, kChunkHeader = 8;
  if (!is_glb) return bytes;
  if (bytes.size() < kHeader + kChunkHeader) return {};
  std::size_t size = 0;
  for (std::size_t k = 4; k-- > 0;) size = size << 8 | static_cast<unsigned char>(bytes[kHeader + k]);
  return std::string_view(bytes).substr(kHeader + kChunkHeader, size);
}

std::vector<std::string> vrm_bones(const Json& gltf) {
  const Json& nodes = at_path(gltf, {"nodes"});
  std::vector<std::string> names;
  if (!nodes.is_array()) return names;
  const auto add = [&](const Json& bone) {
    const Json& node = at_path(bone, {"node"});
    if (!node.is_number_unsigned() || node.get<std::uint64_t>() >= nodes.size()) return;
    const Json& name = at_path(nodes[node.get<std::size_t>()], {"name"});
    if (name.is_string()) names.push_back(name.get<std::string>());
  };
  const std::array<const Json*, 3> humanoids = {
      &at_path(gltf, {"extensions", "VRM", "humanoid", "humanBones"}),                  // 0.x: a list
      &at_path(gltf, {"extensions", "VRMC_vrm", "humanoid", "humanBones"}),             // 1.0: by the bone's name
      &at_path(gltf, {"extensions", "VRMC_vrm_animation", "humanoid", "humanBones"})};  // the same, of a .vrma
  for (const Json* humanoid : humanoids)
    if (humanoid->is_structured())
      for (const Json& bone : *humanoid) add(bone);
  std::sort(names.begin(), names.end());
  names.erase(std::unique(names.begin(), names.end()), names.end());
  return names;
}

}  // namespace cab::scenes
