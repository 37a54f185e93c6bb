// Meshes of robots: glTF and Collada files that assimp alone would read wrong, and polygons.
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
  std::vector<std::string> notes;
  made.json["extensionsUsed"].push_back("EXT_mesh_gpu_instancing");
  for (const char* name : {"mesh.glb", "mesh.gltf"}) {
    const TemporaryFile file(name, name == std::string("mesh.glb") ? glb(made) : gltf_text(made));
    const std::vector<Vec3> vertices = read_mesh(file.path(), "mesh", notes);
    REQUIRE(vertices.size() == 3);
    CHECK(vertices[1][1] == doctest::Approx(.5));
    CHECK(vertices[2][0] == doctest::Approx(1));
    REQUIRE(!notes.empty());
    CHECK(notes.back() == "mesh: EXT_mesh_gpu_instancing: a mesh with many instances is read once");
  }
  made.json["extensionsRequired"] = {"ACME_unknown"};
  const TemporaryFile file("mesh.glb", glb(made));
  CHECK_THROWS_WITH_AS(read_mesh(file.path(), "mesh", notes),
                       "mesh: the extension ACME_unknown is required by the file, but is not supported", ImportError);
}

TEST_CASE("a robot's mesh in a Collada file may have white space before its numbers") {
  std::vector<std::string> notes;
  for (const std::string blank : {"", " ", "\n\t"}) {
    const TemporaryFile file(
        "mesh.dae",
        "<?xml version='1.0'?><COLLADA xmlns='http://www.collada.org/2005/11/COLLADASchema' version='1.4.1'><asset>"
        "<up_axis>Z_UP</up_axis></asset><library_effects><effect id='e'><profile_COMMON><technique sid='c'><phong>"
        "<diffuse><color>" +
            blank +
            "0.8 0.8 0.8 1.0</color></diffuse></phong></technique></profile_COMMON></effect></library_effects>"
            "<library_geometries><geometry id='g'><mesh><source id='p'><float_array id='pa' count='9'>" +
            blank +
            "0 0 0 1 0 0 0 .5 0</float_array><technique_common><accessor source='#pa' count='3' stride='3'>"
            "<param name='X' type='float'/><param name='Y' type='float'/><param name='Z' type='float'/></accessor>"
            "</technique_common></source><vertices id='v'><input semantic='POSITION' source='#p'/></vertices>"
            "<triangles count='1'><input semantic='VERTEX' source='#v' offset='0'/><p>" +
            blank +
            "0 1 2</p></triangles></mesh></geometry></library_geometries><library_visual_scenes><visual_scene id='s'>"
            "<node id='n'><instance_geometry url='#g'/></node></visual_scene></library_visual_scenes><scene>"
            "<instance_visual_scene url='#s'/></scene></COLLADA>");
    const std::vector<Vec3> vertices = read_mesh(file.path(), "mesh", notes);
    REQUIRE(vertices.size() == 3);
    CHECK(vertices[2] == Vec3{1, 0, 0});
  }
}

TEST_CASE("a robot's mesh of concave polygons has their surface and their volume") {
  // A prism over a U, whose hollow is one wide and two deep.
  const std::string u = "v 0 0 Z\nv 3 0 Z\nv 3 3 Z\nv 2 3 Z\nv 2 1 Z\nv 1 1 Z\nv 1 3 Z\nv 0 3 Z\n";
  std::string text;
  for (const char z : {'0', '1'})
    for (const char c : u) text += c == 'Z' ? z : c;
  text +=
      "f 1 8 7 6 5 4 3 2\nf 9 10 11 12 13 14 15 16\nf 1 2 10 9\nf 2 3 11 10\nf 3 4 12 11\nf 4 5 13 12\n"
      "f 5 6 14 13\nf 6 7 15 14\nf 7 8 16 15\nf 8 1 9 16\n";
  const TemporaryFile file("u.obj", text);
  std::vector<std::string> notes;
  std::vector<Vec3> corners;
  CHECK(read_mesh(file.path(), "mesh", notes, &corners).size() == 16);
  REQUIRE(corners.size() == 3 * (6 + 6 + 8 * 2));
  double surface = 0, volume = 0;
  for (std::size_t c = 0; c < corners.size(); c += 3) {
    surface += length(cross(corners[c + 1] - corners[c], corners[c + 2] - corners[c])) / 2;
    volume += dot(corners[c], cross(corners[c + 1], corners[c + 2])) / 6;
  }
  CHECK(surface == doctest::Approx(2 * 7 + 16));
  CHECK(volume == doctest::Approx(7));
}
