// Meshes, weights and inverse bind matrices of a file that the test writes as glTF.
#include "scenes/import/skin_file.h"

#include "scenes/import/import.h"
#include "tests/scenes/import/made_skin.h"
#include "tests/scenes/temporary_file.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <string>
#include <vector>

namespace {

using namespace cab;
using namespace cab::scenes;
using cab::tests::gltf_text;
using cab::tests::Json;
using cab::tests::MadeGltf;
using cab::tests::TemporaryFile;
using cab::tests::two_boxes;

Clip clip_of(const ImportOptions& options, const MadeGltf& made = two_boxes()) {
  const TemporaryFile file("boxes.gltf", gltf_text(made));
  return import_clip(file.path(), options);
}

// The bytes of an accessor's values.
template <class T>
T* values_of(MadeGltf& made, std::size_t accessor) {
  const Json& view = made.json["bufferViews"][made.json["accessors"][accessor]["bufferView"].get<std::size_t>()];
  return reinterpret_cast<T*>(made.bin.data() + view["byteOffset"].get<std::size_t>());
}

// The two boxes with vertices that both joints move by half.
MadeGltf shared_boxes() {
  MadeGltf made = two_boxes();
  const Json attributes = made.json["meshes"][0]["primitives"][0]["attributes"];
  for (std::size_t v = 0; v < 16; ++v) {
    auto* const joints = values_of<std::uint16_t>(made, attributes["JOINTS_0"]) + 4 * v;
    float* const weights = values_of<float>(made, attributes["WEIGHTS_0"]) + 4 * v;
    joints[0] = 0, joints[1] = 1;
    weights[0] = weights[1] = .5f;
  }
  return made;
}

// Adds a second skin of the same joints, with other inverse bind matrices, and a node with the first mesh.
void add_skin(MadeGltf& made, const std::vector<float>& bind) {
  Json& json = made.json;
  json["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", made.bin.size()}, {"byteLength", 128}});
  json["accessors"].push_back(
      {{"bufferView", json["bufferViews"].size() - 1}, {"componentType", 5126}, {"count", 2}, {"type", "MAT4"}});
  made.bin += tests::bytes_of(bind);
  json["buffers"][0]["byteLength"] = made.bin.size();
  json["skins"].push_back({{"joints", {0, 1}}, {"inverseBindMatrices", json["accessors"].size() - 1}});
  json["meshes"][0]["name"] = "coat";
  json["nodes"].push_back({{"name", "again"}, {"mesh", 0}, {"skin", 1}});
  json["scenes"][0]["nodes"].push_back(json["nodes"].size() - 1);
}

std::vector<float> floats_of(MadeGltf& made, std::size_t accessor, std::size_t count) {
  const float* const first = values_of<float>(made, accessor);
  return {first, first + count};
}

}  // namespace

TEST_CASE("a file's skin has all meshes that joints move, with scale in the bodies and rigid poses") {
  ImportOptions options;
  options.skin.emplace();
  options.skin->kinds = rig::kBoxBody;
  options.metres_per_unit = .5;
  const Clip clip = clip_of(options);
  const Character& character = clip.character;
  REQUIRE(character.link_names == std::vector<std::string>{"root", "arm"});
  REQUIRE(character.leaves.size() == 2);
  // Half of 6 units, at half a metre each. The tetrahedron reaches to x = 6 units.
  const float* const half = character.leaves[1].box.half;
  CHECK(std::max({half[0], half[1], half[2]}) == doctest::Approx(1.5).epsilon(1e-5));
  CHECK(std::min({half[0], half[1], half[2]}) == doctest::Approx(.5).epsilon(1e-5));
  const float* const with_prop = character.leaves[0].box.half;
  CHECK(std::max({with_prop[0], with_prop[1], with_prop[2]}) > 1.6);
  CHECK(clip.coverage->share_inside == 1);
  CHECK(clip.coverage->worst_protrusion == 0);
  // The arm's pose is at z = 3 m, with a quaternion of length 1.
  const float* const pose = character.poses.data() + 7;
  CHECK(pose[6] == doctest::Approx(3));
  CHECK(pose[0] * pose[0] + pose[1] * pose[1] + pose[2] * pose[2] + pose[3] * pose[3] == doctest::Approx(1));
  bool is_told = false;
  for (const std::string& note : clip.notes) is_told = is_told || note.find("1 mesh left out") != std::string::npos;
  CHECK(is_told);
}

TEST_CASE("triangles with a vertex that no bone moves are left out of bodies, with their number") {
  MadeGltf made = two_boxes();
  const Json attributes = made.json["meshes"][0]["primitives"][0]["attributes"];
  // The last corner of the second box, which three triangles have.
  values_of<float>(made, attributes["WEIGHTS_0"])[4 * 15] = 0;
  ImportOptions options;
  options.skin.emplace();
  for (const bool is_surface : {false, true}) {
    CAPTURE(is_surface);
    options.skin->surface = is_surface;
    const auto counts = [&](const MadeGltf& file) {
      std::vector<std::uint64_t> found;
      for (const Alteration& alteration : clip_of(options, file).alterations)
        if (alteration.note.find("a corner without weight") != std::string::npos) found.push_back(alteration.count);
      return found;
    };
    CHECK(counts(two_boxes()).empty());
    CHECK(counts(made) == std::vector<std::uint64_t>{3});
  }
}

TEST_CASE("an animation is chosen by name or by number, and a wrong one is refused with the names that there are") {
  ImportOptions options;
  options.skin.emplace();
  for (const char* text : {"out", "1"}) {
    options.animation = text;
    const Clip clip = clip_of(options);
    REQUIRE(clip.frame_count == 2);
    CHECK(clip.character.poses[7 * 3 + 6] == doctest::Approx(9));
  }
  for (const char* text : {"", "still", "0"}) {
    options.animation = text;
    const Clip clip = clip_of(options);
    REQUIRE(clip.frame_count == 2);
    CHECK(clip.character.poses[7 * 3 + 6] == doctest::Approx(6));
  }
  options.animation = "walk";
  CHECK_THROWS_WITH_AS(clip_of(options), doctest::Contains("no animation walk among \"still\", \"out\""), ImportError);
}

TEST_CASE("bodies of a skin are refused where there is no mesh or no joint of a name") {
  ImportOptions options;
  options.skin.emplace();
  options.skin->kept_joints = {"root", "leg"};
  CHECK_THROWS_WITH_AS(clip_of(options), doctest::Contains("no joint is named leg"), ImportError);
  options.skin->kept_joints = {"root"};
  CHECK(clip_of(options).character.link_names == std::vector<std::string>{"root"});
  options.skin->kept_joints.clear();
  const TemporaryFile bvh("clip.bvh",
                          "HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 3 Xrotation Yrotation Zrotation\nEnd Site\n{\n"
                          "OFFSET 0 1 0\n}\n}\nMOTION\nFrames: 1\nFrame Time: .01\n0 0 0\n");
  CHECK_THROWS_WITH_AS(import_clip(bvh.path(), options), doctest::Contains("no skin"), ImportError);
}

TEST_CASE("a file's surface has the triangles of all meshes that joints move, with scale in its matrices") {
  ImportOptions options;
  options.skin.emplace().surface = true;
  options.metres_per_unit = .5;
  options.animation = "out";
  const Clip clip = clip_of(options);
  const Character& character = clip.character;
  REQUIRE(character.link_names == std::vector<std::string>{"root", "arm"});
  REQUIRE(clip.surface);
  CHECK(clip.surface->triangle_count == 12 + 12 + 4);
  CHECK(clip.surface->part_count == 3);
  CHECK(clip.surface->open_part_count == 0);
  CHECK(clip.surface->left_out_count == 0);
  CHECK(clip.surface->worst_distance < 1e-6);
  CHECK(!clip.coverage);
  std::size_t corners = 0;
  for (const BodyLeaf& leaf : character.leaves) corners += leaf.triangles.size();
  CHECK(corners == 3 * 28);
  CHECK(character.skin.vertices.size() == 3 * clip.surface->vertex_count);
  CHECK(std::any_of(clip.notes.begin(), clip.notes.end(), [](const std::string& note) {
    return note.find("28 triangles in 2 leaves of 2 links") == 0 && note.find("3 parts") != std::string::npos;
  }));
  // Hulls of the same file have the same poses.
  ImportOptions hulls = options;
  hulls.skin->surface = false;
  CHECK(clip_of(hulls).character.poses == character.poses);
  CHECK(clip_of(hulls).character.skin.vertices.empty());
}

TEST_CASE("a surface of meshes with other inverse bind matrices is one, or is refused with mesh and joint") {
  ImportOptions options;
  options.skin.emplace().surface = true;
  MadeGltf made = shared_boxes();
  std::vector<float> bind = floats_of(made, made.json["skins"][0]["inverseBindMatrices"], 32);
  // Both joints as from a mesh that is one unit away along x.
  std::vector<float> away = bind;
  away[12] -= 1;
  away[28] -= .5f;
  MadeGltf moved = made;
  add_skin(moved, away);
  const Clip clip = clip_of(options, moved);
  CHECK(clip.surface->triangle_count == 24 + 24 + 4);
  CHECK(clip.surface->worst_distance < 1e-6);
  away[28] += 3;
  MadeGltf torn = made;
  add_skin(torn, away);
  CHECK_THROWS_WITH_AS(clip_of(options, torn), doctest::Contains("mesh coat, joint arm: two bones of one joint"),
                       ImportError);
  std::fill_n(away.begin() + 16, 12, 0.0f);
  MadeGltf flat = made;
  add_skin(flat, away);
  CHECK_THROWS_WITH_AS(clip_of(options, flat), doctest::Contains("mesh coat, joint arm: the matrix of a bone"),
                       ImportError);
}

TEST_CASE("a surface of a file without a skin, and negative weights, are refused") {
  ImportOptions options;
  options.skin.emplace().surface = true;
  const TemporaryFile bvh("clip.bvh",
                          "HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 3 Xrotation Yrotation Zrotation\nEnd Site\n{\n"
                          "OFFSET 0 1 0\n}\n}\nMOTION\nFrames: 1\nFrame Time: .01\n0 0 0\n");
  CHECK_THROWS_WITH_AS(import_clip(bvh.path(), options), doctest::Contains("no skin"), ImportError);
  MadeGltf made = shared_boxes();
  float* const weights = values_of<float>(made, made.json["meshes"][0]["primitives"][0]["attributes"]["WEIGHTS_0"]);
  weights[4] = 1.5f, weights[5] = -.5f;
  CHECK_THROWS_WITH_AS(clip_of(options, made),
                       doctest::Contains(".WEIGHTS_0 has a weight that is negative at vertex 1"), ImportError);
}

TEST_CASE("a vertex has all weights of its file, and one with more than 32 is refused") {
  ImportOptions options;
  options.skin.emplace();
  for (const int sets : {8, 9}) {
    MadeGltf made = shared_boxes();
    Json& attributes = made.json["meshes"][0]["primitives"][0]["attributes"];
    for (std::size_t v = 0; v < 16; ++v) {
      std::fill_n(values_of<float>(made, attributes["WEIGHTS_0"]) + 4 * v, 4, .25f);
      for (std::uint16_t k = 0; k < 4; ++k) values_of<std::uint16_t>(made, attributes["JOINTS_0"])[4 * v + k] = k % 2;
    }
    for (int set = 1; set < sets; ++set)
      for (const std::string kind : {"JOINTS_", "WEIGHTS_"})
        attributes[kind + std::to_string(set)] = attributes[kind + "0"];
    const TemporaryFile file("boxes.gltf", gltf_text(made));
    if (sets == 8)
      CHECK(import_skeleton(file.path(), options).skin.influence_count == 32);
    else
      CHECK_THROWS_WITH_AS(import_skeleton(file.path(), options),
                           doctest::Contains("vertex 0 has more than 32 weights"), ImportError);
  }
}
