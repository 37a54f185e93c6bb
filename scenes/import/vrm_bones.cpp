// Reads the humanoid of a VRM file.
#include "scenes/import/vrm_bones.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <initializer_list>
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

std::vector<std::size_t> vrm_bones(const Json& gltf) {
  const Json& nodes = at_path(gltf, {"nodes"});
  std::vector<std::size_t> bones;
  if (!nodes.is_array()) return bones;
  const auto add = [&](const Json& bone) {
    const Json& node = at_path(bone, {"node"});
    if (node.is_number_unsigned() && node.get<std::uint64_t>() < nodes.size()) bones.push_back(node.get<std::size_t>());
  };
  const std::array<const Json*, 3> humanoids = {
      &at_path(gltf, {"extensions", "VRM", "humanoid", "humanBones"}),                  // 0.x: a list
      &at_path(gltf, {"extensions", "VRMC_vrm", "humanoid", "humanBones"}),             // 1.0: by the bone's name
      &at_path(gltf, {"extensions", "VRMC_vrm_animation", "humanoid", "humanBones"})};  // the same, of a .vrma
  for (const Json* humanoid : humanoids)
    if (humanoid->is_structured())
      for (const Json& bone : *humanoid) add(bone);
  std::sort(bones.begin(), bones.end());
  bones.erase(std::unique(bones.begin(), bones.end()), bones.end());
  return bones;
}

}  // namespace cab::scenes
