// A small glTF file to change: three nodes in a row, the middle one moved along y.
#pragma once

#include <nlohmann/json.hpp>

#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

namespace cab::tests {

using Json = nlohmann::json;

struct MadeGltf {
  Json json;
  std::string bin;
};

inline std::string bytes_of(const std::vector<float>& values) {
  std::string bytes(values.size() * sizeof(float), '\0');
  if (!values.empty()) std::memcpy(bytes.data(), values.data(), bytes.size());
  return bytes;
}

// Two views of one buffer: the times of the keys in seconds, and a place for each. At key k the place is (0, 1, k). The
// outer nodes have no track, and no node has a track for its rotation or scale.
inline MadeGltf made_gltf(const std::vector<float>& times) {
  std::vector<float> places;
  for (std::size_t k = 0; k < times.size(); ++k) places.insert(places.end(), {0, 1, static_cast<float>(k)});
  MadeGltf made;
  made.bin = bytes_of(times) + bytes_of(places);
  const std::size_t split = 4 * times.size();
  made.json = Json::parse(R"({
    "asset": {"version": "2.0"},
    "scene": 0,
    "scenes": [{"nodes": [0]}],
    "nodes": [{"name": "a", "children": [1]},
              {"name": "b", "translation": [0, 1, 0], "children": [2]},
              {"name": "c", "translation": [0, 1, 0]}],
    "animations": [{"name": "walk",
                    "samplers": [{"input": 0, "output": 1}],
                    "channels": [{"sampler": 0, "target": {"node": 1, "path": "translation"}},
                                 {"sampler": 0, "target": {"node": 0, "path": "translation"}}]}],
    "accessors": [{"bufferView": 0, "componentType": 5126, "type": "SCALAR"},
                  {"bufferView": 1, "componentType": 5126, "type": "VEC3"}],
    "bufferViews": [{"buffer": 0, "byteOffset": 0}, {"buffer": 0}],
    "buffers": [{}]
  })");
  for (Json& accessor : made.json["accessors"]) accessor["count"] = times.size();
  made.json["bufferViews"][0]["byteLength"] = split;
  made.json["bufferViews"][1]["byteOffset"] = split;
  made.json["bufferViews"][1]["byteLength"] = made.bin.size() - split;
  made.json["buffers"][0]["byteLength"] = made.bin.size();
  return made;
}

inline std::string base64(const std::string& bytes) {
  const char* const digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k)
      group = (group << 8) | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k) text += i + k > bytes.size() ? '=' : digits[(group >> (18 - 6 * k)) & 63];
  }
  return text;
}

// The file as text, with the bytes in its JSON.
inline std::string gltf_text(MadeGltf made) {
  made.json["buffers"][0]["uri"] = "data:application/octet-stream;base64," + base64(made.bin);
  return made.json.dump();
}

inline std::string little_endian(std::uint32_t number) {
  std::string bytes;
  for (int k = 0; k < 4; ++k) bytes += static_cast<char>(number >> (8 * k) & 255);
  return bytes;
}

inline std::string glb_chunk(const std::string& type, std::string bytes, char filler) {
  while (bytes.size() % 4 != 0) bytes += filler;
  return little_endian(static_cast<std::uint32_t>(bytes.size())) + type + bytes;
}

// The file as a GLB.
inline std::string glb(const MadeGltf& made, std::uint32_t version = 2) {
  const std::string chunks =
      glb_chunk("JSON", made.json.dump(), ' ') + glb_chunk(std::string("BIN\0", 4), made.bin, '\0');
  return "glTF" + little_endian(version) + little_endian(static_cast<std::uint32_t>(12 + chunks.size())) + chunks;
}

}  // namespace cab::tests
