// Which nodes of a VRM file are bones: its humanoid says so.
#pragma once

#include <cstddef>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace cab::scenes {

// The indices of the nodes that the humanoid of a glTF document maps to bones, each once, in order: VRM 0.x, VRM 1.0,
// and animations of VRM 1.0. Entries that name no node are passed over; the document may be any JSON.
std::vector<std::size_t> vrm_bones(const nlohmann::json& gltf);

}  // namespace cab::scenes
