// Meshes, weights and inverse bind matrices of a file that the test writes as glTF.
#include "scenes/import/skin_file.h"

#include "scenes/import/import.h"
#include "tests/scenes/temporary_file.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace {

using namespace cab;
using namespace cab::scenes;
using cab::tests::TemporaryFile;
using Json = nlohmann::json;

// A glTF file with its buffer inside.
struct Gltf {
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

  std::string text() {
    const char* const digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    bytes.resize((bytes.size() + 2) / 3 * 3);
    std::string base64;
    for (std::size_t b = 0; b < bytes.size(); b += 3) {
      unsigned word = 0;
      for (std::size_t k = 0; k < 3; ++k) word = word << 8 | static_cast<unsigned char>(bytes[b + k]);
      for (int shift = 18; shift >= 0; shift -= 6) base64 += digits[word >> shift & 63];
    }
    json["buffers"] = {{{"byteLength", bytes.size()}, {"uri", "data:application/octet-stream;base64," + base64}}};
    return json.dump();
  }
};

// Two boxes 2 x 2 x 6 along z: one for the joint `root`, one for the joint `arm`, which is at z = 6 and scaled by 2. A
// tetrahedron without weights hangs from root, another from no joint. Two animations of one second: in `still` nothing
// moves, in `out` the arm moves to z = 9.
std::string two_boxes() {
  Gltf file;
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
  return file.text();
}

Clip clip_of(const ImportOptions& options) {
  const TemporaryFile file("boxes.gltf", two_boxes());
  return import_clip(file.path(), options);
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
