// A small glTF file with a skin to change: two boxes, two joints and two animations.
#pragma once

#include "tests/scenes/import/made_gltf.h"

#include <nlohmann/json.hpp>

#include <cstdint>
#include <string>
#include <vector>

namespace cab::tests {

// A glTF file that grows by arrays.
struct SkinWriter {
  std::string bytes;
  Json json = {{"asset", {{"version", "2.0"}}}, {"accessors", Json::array()}, {"bufferViews", Json::array()}};

  // Adds an array and returns the index of its accessor. 5126 is float, 5123 is unsigned 16 bit.
  template <class T>
  std::size_t add(const std::vector<T>& values, const char* type, std::size_t width) {
    const int component = sizeof(T) == 4 ? 5126 : 5123;
    json["bufferViews"].push_back(
        {{"buffer", 0}, {"byteOffset", bytes.size()}, {"byteLength", values.size() * sizeof(T)}});
    json["accessors"].push_back({{"bufferView", json["bufferViews"].size() - 1},
                                 {"componentType", component},
                                 {"count", values.size() / width},
                                 {"type", type}});
    bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
    bytes.resize((bytes.size() + 3) / 4 * 4);
    return json["accessors"].size() - 1;
  }
};

// Two boxes 2 x 2 x 6 along z: one for the joint `root`, one for the joint `arm`, which is at z = 6 and scaled by 2. A
// tetrahedron without weights hangs from root, another from no joint. Two animations of one second: in `still` nothing
// moves, in `out` the arm moves to z = 9.
inline MadeGltf two_boxes() {
  SkinWriter file;
  std::vector<float> points, weights;
  std::vector<std::uint16_t> joints, triangles;
  for (std::uint16_t box = 0; box < 2; ++box) {
    for (int c = 0; c < 8; ++c) {
      points.insert(points.end(), {c & 1 ? 1.0f : -1.0f, c & 2 ? 1.0f : -1.0f, 6.0f * box + (c & 4 ? 6.0f : 0.0f)});
      joints.insert(joints.end(), {box, 0, 0, 0});
      weights.insert(weights.end(), {1, 0, 0, 0});
    }
    for (const int corner :
         {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4, 2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5})
      triangles.push_back(static_cast<std::uint16_t>(8 * box + corner));
  }
  const std::vector<float> bind = {1,   0, 0, 0, 0, 1,   0, 0, 0, 0, 1,   0, 0, 0, 0,  1,
                                   .5f, 0, 0, 0, 0, .5f, 0, 0, 0, 0, .5f, 0, 0, 0, -3, 1};
  const std::vector<float> corners = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  const std::vector<std::uint16_t> faces = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
  const std::size_t skinned = file.add(points, "VEC3", 3), first = file.add(joints, "VEC4", 4);
  const std::size_t weight = file.add(weights, "VEC4", 4), index = file.add(triangles, "SCALAR", 1);
  const std::size_t matrices = file.add(bind, "MAT4", 16);
  const std::size_t corner = file.add(corners, "VEC3", 3), face = file.add(faces, "SCALAR", 1);
  const std::size_t times = file.add(std::vector<float>{0, 1}, "SCALAR", 1);
  const std::size_t still = file.add(std::vector<float>{0, 0, 6, 0, 0, 6}, "VEC3", 3);
  const std::size_t out = file.add(std::vector<float>{0, 0, 6, 0, 0, 9}, "VEC3", 3);
  file.json["meshes"] = {
      {{"primitives",
        {{{"attributes", {{"POSITION", skinned}, {"JOINTS_0", first}, {"WEIGHTS_0", weight}}}, {"indices", index}}}}},
      {{"primitives", {{{"attributes", {{"POSITION", corner}}}, {"indices", face}}}}}};
  file.json["nodes"] = {{{"name", "root"}, {"children", {1, 3}}},
                        {{"name", "arm"}, {"translation", {0, 0, 6}}, {"scale", {2, 2, 2}}},
                        {{"name", "skinned"}, {"mesh", 0}, {"skin", 0}},
                        {{"name", "prop"}, {"mesh", 1}, {"translation", {5, 0, 0}}},
                        {{"name", "loose"}, {"mesh", 1}}};
  file.json["skins"] = {{{"joints", {0, 1}}, {"inverseBindMatrices", matrices}}};
  file.json["scenes"] = {{{"nodes", {0, 2, 4}}}};
  file.json["scene"] = 0;
  const auto animation = [&](const char* name, std::size_t values) {
    return Json{{"name", name},
                {"samplers", {{{"input", times}, {"output", values}}}},
                {"channels", {{{"sampler", 0}, {"target", {{"node", 1}, {"path", "translation"}}}}}}};
  };
  file.json["animations"] = {animation("still", still), animation("out", out)};
  file.json["buffers"][0]["byteLength"] = file.bytes.size();
  return {file.json, file.bytes};
}

}  // namespace cab::tests
