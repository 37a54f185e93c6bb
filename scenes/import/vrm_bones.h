// Which nodes of a VRM file are bones: its humanoid says so.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace cab::scenes {

// The JSON of a glTF file's bytes: the first chunk of a GLB, or all of the text. The bytes are those that check_gltf
// took.
std::string_view json_of_gltf(const std::string& bytes, bool is_glb);

// The names of the nodes that the humanoid of a glTF document maps to bones: VRM 0.x, VRM 1.0, and animations of VRM
// 1.0. Nodes without a name have none. Entries that name no node are passed over; the document may be any JSON.
std::vector<std::string> vrm_bones(const nlohmann::json& gltf);

}  // namespace cab::scenes
