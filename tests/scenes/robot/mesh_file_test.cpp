// Meshes of robots that assimp alone would read wrong.
#include "scenes/robot/mesh_file.h"

#include "scenes/import/import.h"
#include "tests/scenes/import/made_gltf.h"
#include "tests/scenes/temporary_file.h"

#include <doctest/doctest.h>

#include <string>
#include <vector>

namespace {

using namespace cab;
using namespace cab::scenes;
using namespace cab::tests;

// A triangle in millimetres, in 16 bits.
MadeGltf triangle() {
  MadeGltf made;
  for (const int value : {0, 0, 0, 1000, 0, 0, 0, 500, 0})
    made.bin += std::string{static_cast<char>(value & 255), static_cast<char>(value >> 8)};
  made.json = Json::parse(R"({"asset": {"version": "2.0"}, "extensionsUsed": ["KHR_mesh_quantization"],
    "extensionsRequired": ["KHR_mesh_quantization"], "scene": 0, "scenes": [{"nodes": [0]}],
    "nodes": [{"mesh": 0, "scale": [0.001, 0.001, 0.001]}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
    "accessors": [{"bufferView": 0, "componentType": 5122, "count": 3, "type": "VEC3"}],
    "bufferViews": [{"buffer": 0, "byteLength": 18}], "buffers": [{"byteLength": 18}]})");
  return made;
}

}  // namespace

TEST_CASE("a robot's mesh in a quantized glTF file has its size, and an unknown required extension is refused") {
  MadeGltf made = triangle();
  for (const char* name : {"mesh.glb", "mesh.gltf"}) {
    const TemporaryFile file(name, name == std::string("mesh.glb") ? glb(made) : gltf_text(made));
    const std::vector<Vec3> vertices = read_mesh(file.path(), "mesh");
    REQUIRE(vertices.size() == 3);
    CHECK(vertices[1][1] == doctest::Approx(.5));
    CHECK(vertices[2][0] == doctest::Approx(1));
  }
  made.json["extensionsRequired"] = {"ACME_unknown"};
  const TemporaryFile file("mesh.glb", glb(made));
  CHECK_THROWS_WITH_AS(read_mesh(file.path(), "mesh"),
                       "mesh: the extension ACME_unknown is required by the file, but is not supported", ImportError);
}
