// What assimp gets of glTF files: numbers of every type as floats, unique names, one mesh for each skin.
#include "scenes/import/gltf_rewrite.h"

#include "scenes/import/import.h"
#include "tests/scenes/import/made_skin.h"
#include "tests/scenes/temporary_file.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <functional>
#include <limits>

namespace {

using namespace cab::scenes;
using namespace cab::tests;

constexpr int kByte = 5120, kUnsignedByte = 5121, kShort = 5122, kUnsignedShort = 5123, kUnsignedInt = 5125;
// Accessors of two_boxes(); 3 is that of the indices.
constexpr std::size_t kPositions = 0, kJoints = 1, kWeights = 2, kMatrices = 4;
// The first vertex of the boxes in a Skeleton: the tetrahedron at `prop` is before them.
constexpr std::size_t kFirst = 4;

Skeleton skin_of(const MadeGltf& made) {
  const TemporaryFile file("boxes.glb", glb(made));
  ImportOptions options;
  options.skin.emplace();
  return import_skeleton(file.path(), options);
}

Skeleton motion_of(const MadeGltf& made, const std::string& animation = {}) {
  const TemporaryFile file("clip.glb", glb(made));
  ImportOptions options;
  options.animation = animation;
  return import_skeleton(file.path(), options);
}

// The complaint about a file without its name; empty if it is read.
std::string complaint_about(const MadeGltf& made) {
  const TemporaryFile file("boxes.glb", glb(made));
  ImportOptions options;
  options.skin.emplace();
  try {
    import_skeleton(file.path(), options);
  } catch (const ImportError& error) {
    const std::string line = error.what();
    CHECK(line.size() < 300 + file.path().size());
    return line.substr(file.path().size() + 2);
  }
  return {};
}

std::string complaint_after(const std::function<void(MadeGltf& made)>& change) {
  MadeGltf made = two_boxes();
  change(made);
  return complaint_about(made);
}

bool has_note(const Skeleton& skeleton, const std::string& text) {
  return std::any_of(skeleton.notes.begin(), skeleton.notes.end(),
                     [&text](const std::string& note) { return note.find(text) != std::string::npos; });
}

void check_same_skin(const FileSkin& a, const FileSkin& b) {
  CHECK(a.vertices == b.vertices);
  CHECK(a.triangles == b.triangles);
  CHECK(a.influence_count == b.influence_count);
  CHECK(a.influence_bones == b.influence_bones);
  CHECK(a.influence_weights == b.influence_weights);
  CHECK(a.inverse_bind == b.inverse_bind);
  CHECK(a.bone_joints == b.bone_joints);
}

template <class T>
std::string as_bytes(const std::vector<T>& values) {
  std::string bytes(values.size() * sizeof(T), '\0');
  std::memcpy(bytes.data(), values.data(), bytes.size());
  return bytes;
}

// Adds bytes and a view of them, and returns its index.
std::size_t add_view(MadeGltf& made, const std::string& bytes) {
  made.bin.resize((made.bin.size() + 3) / 4 * 4);
  made.json["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", made.bin.size()}, {"byteLength", bytes.size()}});
  made.bin += bytes;
  made.json["buffers"][0]["byteLength"] = made.bin.size();
  return made.json["bufferViews"].size() - 1;
}

std::vector<float> floats_of(const MadeGltf& made, std::size_t accessor) {
  const Json& item = made.json["accessors"][accessor];
  const std::size_t width = item["type"] == "VEC4" ? 4 : item["type"] == "VEC3" ? 3 : item["type"] == "MAT4" ? 16 : 1;
  std::vector<float> values(item["count"].get<std::size_t>() * width);
  const std::size_t offset = made.json["bufferViews"][item["bufferView"].get<std::size_t>()]["byteOffset"];
  std::memcpy(values.data(), made.bin.data() + offset, values.size() * sizeof(float));
  return values;
}

// Gives an accessor other numbers.
template <class T>
void replace_values(MadeGltf& made, std::size_t accessor, const std::vector<T>& values, int component) {
  made.json["accessors"][accessor]["bufferView"] = add_view(made, as_bytes(values));
  made.json["accessors"][accessor]["componentType"] = component;
}

// Turns floats into integers, times `scale`.
template <class T>
void make_integers(MadeGltf& made, std::size_t accessor, int component, double scale, bool normalized) {
  std::vector<T> integers;
  for (const float value : floats_of(made, accessor)) integers.push_back(static_cast<T>(std::lround(value * scale)));
  replace_values(made, accessor, integers, component);
  if (normalized) made.json["accessors"][accessor]["normalized"] = true;
}

std::vector<std::uint8_t> small_joints(const MadeGltf& made) {
  std::vector<std::uint8_t> joints;
  const std::size_t offset = made.json["bufferViews"][kJoints]["byteOffset"];
  for (std::size_t k = 0; k < 4 * 16; ++k) joints.push_back(static_cast<std::uint8_t>(made.bin[offset + 2 * k]));
  return joints;
}

// Two people of hips and a spine at x = 0 and 2, animated: the spine of the second moves to y = 3.
MadeGltf two_people() {
  MadeGltf made = made_gltf({0, 1});
  made.json["nodes"] = Json::parse(R"([{"name": "Hips", "children": [1]}, {"name": "Spine", "translation": [0, 1, 0]},
      {"name": "Hips", "translation": [2, 0, 0], "children": [3]}, {"name": "Spine", "translation": [0, 1, 0]}])");
  made.json["scenes"][0]["nodes"] = {0, 2};
  made.json["animations"][0]["channels"] = Json::array();
  for (const int node : {0, 1, 3})
    made.json["animations"][0]["channels"].push_back(
        {{"sampler", 0}, {"target", {{"node", node}, {"path", node == 3 ? "translation" : "scale"}}}});
  return made;
}

}  // namespace

TEST_CASE("weights of 8 and 16 bits are the floats that they mean, beside joints of 8 and 16 bits") {
  const FileSkin floats = skin_of(two_boxes()).skin;
  REQUIRE(floats.influence_count == 1);
  for (const bool bytes : {true, false}) {
    for (const bool small : {true, false}) {
      for (const bool says_normalized : {true, false}) {
        CAPTURE(bytes);
        CAPTURE(small);
        MadeGltf made = two_boxes();
        if (bytes)
          make_integers<std::uint8_t>(made, kWeights, kUnsignedByte, 255, says_normalized);
        else
          make_integers<std::uint16_t>(made, kWeights, kUnsignedShort, 65535, says_normalized);
        if (small) replace_values(made, kJoints, small_joints(made), kUnsignedByte);
        const Skeleton skeleton = skin_of(made);
        check_same_skin(skeleton.skin, floats);
        CHECK(has_note(skeleton, "integers are read as floats: weights"));
      }
    }
  }
  // A share that is not whole: 51 / 255 and 13107 / 65535 are .2.
  for (const bool bytes : {true, false}) {
    MadeGltf made = two_boxes();
    std::vector<std::uint16_t> joints;
    std::vector<std::uint8_t> small;
    std::vector<std::uint16_t> large;
    for (std::size_t v = 0; v < 16; ++v) {
      joints.insert(joints.end(), {0, 1, 0, 0});
      small.insert(small.end(), {51, 204, 0, 0});
      large.insert(large.end(), {13107, 52428, 0, 0});
    }
    replace_values(made, kJoints, joints, kUnsignedShort);
    if (bytes)
      replace_values(made, kWeights, small, kUnsignedByte);
    else
      replace_values(made, kWeights, large, kUnsignedShort);
    const FileSkin skin = skin_of(made).skin;
    REQUIRE(skin.influence_count == 2);
    for (std::size_t v = kFirst; v < kFirst + 16; ++v) {
      CHECK(skin.influence_weights[2 * v] == doctest::Approx(.8f));
      CHECK(skin.influence_weights[2 * v + 1] == doctest::Approx(.2f));
      CHECK(skin.bone_joints[skin.influence_bones[2 * v]] == 1);
    }
  }
}

TEST_CASE("joints and weights may be in any slot and any set, in any order of the JSON") {
  const FileSkin floats = skin_of(two_boxes()).skin;
  // The whole weight in slot 2 of set 1; set 0 has none.
  MadeGltf made = two_boxes();
  std::vector<std::uint8_t> weights, joints;
  for (const std::uint8_t joint : small_joints(made)) joints.push_back(joint);
  for (std::size_t v = 0; v < 16; ++v) {
    weights.insert(weights.end(), {0, 0, 255, 0});
    std::swap(joints[4 * v], joints[4 * v + 2]);
  }
  Json& accessors = made.json["accessors"];
  const std::size_t first = accessors.size();
  accessors.push_back(accessors[kJoints]);
  accessors.push_back(accessors[kWeights]);
  replace_values(made, first, joints, kUnsignedByte);
  replace_values(made, first + 1, weights, kUnsignedByte);
  replace_values(made, kWeights, std::vector<float>(64, 0), 5126);
  Json& attributes = made.json["meshes"][0]["primitives"][0]["attributes"];
  attributes["JOINTS_1"] = first;
  attributes["WEIGHTS_1"] = first + 1;
  check_same_skin(skin_of(made).skin, floats);
  // A set 3 alone.
  attributes = {{"POSITION", kPositions}, {"JOINTS_3", first}, {"WEIGHTS_3", first + 1}};
  check_same_skin(skin_of(made).skin, floats);
}

TEST_CASE("items with gaps, sparse items and items without a view are in their places") {
  const FileSkin floats = skin_of(two_boxes()).skin;
  // Positions, joints and weights of each vertex side by side, without the filler behind the last.
  MadeGltf made = two_boxes();
  const std::vector<float> positions = floats_of(made, kPositions);
  const std::vector<std::uint8_t> joints = small_joints(made);
  std::string bytes;
  for (std::ptrdiff_t v = 0; v < 16; ++v) {
    bytes += as_bytes(std::vector<float>(positions.begin() + 3 * v, positions.begin() + 3 * v + 3));
    bytes += as_bytes(std::vector<std::uint8_t>(joints.begin() + 4 * v, joints.begin() + 4 * v + 4));
    bytes += as_bytes(std::vector<std::uint8_t>{255, 0, 0, 0});
    if (v < 15) bytes += "gaps";
  }
  const std::size_t view = add_view(made, bytes);
  made.json["bufferViews"][view]["byteStride"] = 24;
  const auto place_at = [&](std::size_t accessor, std::size_t offset, int component) {
    Json& item = made.json["accessors"][accessor];
    item["bufferView"] = view;
    item["byteOffset"] = offset;
    item["componentType"] = component;
  };
  place_at(kPositions, 0, 5126);
  place_at(kJoints, 12, kUnsignedByte);
  place_at(kWeights, 16, kUnsignedByte);
  check_same_skin(skin_of(made).skin, floats);

  // Sparse over a strided base: vertex 3 is at (9, 8, 7).
  const std::size_t index = add_view(made, as_bytes(std::vector<std::uint16_t>{3}));
  const std::size_t value = add_view(made, as_bytes(std::vector<float>{9, 8, 7}));
  made.json["accessors"][kPositions]["sparse"] = {
      {"count", 1},
      {"indices", {{"bufferView", index}, {"componentType", kUnsignedShort}}},
      {"values", {{"bufferView", value}}}};
  std::vector<float> moved = floats.vertices;
  const auto moved_vertex = moved.begin() + 3 * (kFirst + 3);
  std::copy_n(std::vector<float>{9, 8, 7}.begin(), 3, moved_vertex);
  CHECK(skin_of(made).skin.vertices == moved);
  made.json["accessors"][kPositions].erase("bufferView");  // all others are at 0
  std::fill_n(moved.begin() + 3 * kFirst, 48, 0.0f);
  std::copy_n(std::vector<float>{9, 8, 7}.begin(), 3, moved_vertex);
  CHECK(skin_of(made).skin.vertices == moved);
}

TEST_CASE("positions of KHR_mesh_quantization are the numbers that they mean") {
  std::vector<float> positions = floats_of(two_boxes(), kPositions);  // within -1 and 1, as normalized numbers must be
  for (float& value : positions) value /= 12;
  const auto check = [&](auto type, int component, double scale, bool normalized) {
    using T = decltype(type);
    CAPTURE(component);
    CAPTURE(normalized);
    MadeGltf made = two_boxes();
    std::vector<T> integers;
    for (const float value : positions)
      integers.push_back(static_cast<T>(std::lround((std::is_signed_v<T> ? value : std::fabs(value)) * scale)));
    replace_values(made, kPositions, integers, component);
    made.json["accessors"][kPositions]["normalized"] = normalized;
    made.json["extensionsUsed"] = made.json["extensionsRequired"] = {"KHR_mesh_quantization"};
    const Skeleton skeleton = skin_of(made);
    CHECK(has_note(skeleton, "integers are read as floats: positions"));
    for (std::size_t k = 0; k < positions.size(); ++k) {
      const double expected = std::is_signed_v<T> ? positions[k] : std::fabs(positions[k]);
      CHECK(std::fabs(skeleton.skin.vertices[3 * kFirst + k] / (normalized ? 1 : scale) - expected) <=
            .5 / scale + 1e-6);
    }
  };
  check(std::int8_t{}, kByte, 127, true);
  check(std::uint8_t{}, kUnsignedByte, 255, true);
  check(std::int16_t{}, kShort, 32767, true);
  check(std::uint16_t{}, kUnsignedShort, 65535, true);
  check(std::int8_t{}, kByte, 100, false);
  check(std::uint8_t{}, kUnsignedByte, 100, false);
  check(std::int16_t{}, kShort, 1000, false);
  check(std::uint16_t{}, kUnsignedShort, 1000, false);
  // The lowest number means -1 too.
  MadeGltf made = two_boxes();
  replace_values(made, kPositions, std::vector<std::int16_t>(48, -32768), kShort);
  made.json["accessors"][kPositions]["normalized"] = true;
  CHECK(skin_of(made).skin.vertices[3 * kFirst] == -1);
}

TEST_CASE("rotation keys in integers turn as the floats do") {
  // A quarter turn about z.
  const float half = std::sqrt(.5f);
  const std::vector<float> keys = {0, 0, 0, 1, 0, 0, half, half};
  const auto rotated = [&](auto values, int component) {
    MadeGltf made = two_boxes();
    Json& accessors = made.json["accessors"];
    const std::size_t output = accessors.size();
    accessors.push_back({{"bufferView", 0}, {"componentType", component}, {"count", 2}, {"type", "VEC4"}});
    replace_values(made, output, values, component);
    made.json["animations"][0]["samplers"][0]["output"] = output;
    made.json["animations"][0]["channels"][0]["target"]["path"] = "rotation";
    return motion_of(made);
  };
  const auto integers = [&](auto type, double scale) {
    std::vector<decltype(type)> values;
    for (const float key : keys) values.push_back(static_cast<decltype(type)>(std::lround(key * scale)));
    return values;
  };
  const Skeleton floats = rotated(keys, 5126);
  REQUIRE(floats.frame_count == 2);
  CHECK(floats.rotations[4 * 3 + 2] == doctest::Approx(half));
  CHECK(!has_note(floats, "integers"));
  const auto check = [&](const Skeleton& skeleton, double tolerance) {
    CHECK(has_note(skeleton, "integers are read as floats: keys"));
    REQUIRE(skeleton.rotations.size() == floats.rotations.size());
    for (std::size_t k = 0; k < floats.rotations.size(); ++k)
      CHECK(std::fabs(skeleton.rotations[k] - floats.rotations[k]) < tolerance);
  };
  check(rotated(integers(std::int8_t{}, 127), kByte), .01);
  check(rotated(integers(std::uint8_t{}, 255), kUnsignedByte), .01);
  check(rotated(integers(std::int16_t{}, 32767), kShort), 1e-4);
  check(rotated(integers(std::uint16_t{}, 65535), kUnsignedShort), 1e-4);
}

TEST_CASE("a skin without inverse bind matrices has the identity, with a note") {
  MadeGltf made = two_boxes();
  std::vector<float> identity;
  for (int k = 0; k < 32; ++k) identity.push_back(k % 16 % 5 == 0 ? 1.0f : 0.0f);
  replace_values(made, kMatrices, identity, 5126);
  const FileSkin given = skin_of(made).skin;
  made.json["skins"][0].erase("inverseBindMatrices");
  const Skeleton skeleton = skin_of(made);
  check_same_skin(skeleton.skin, given);
  CHECK(has_note(skeleton, "skins[0] has no inverse bind matrices"));
}

TEST_CASE("two people with joints of the same names are two people, each with its own motion") {
  const Skeleton skeleton = motion_of(two_people());
  REQUIRE(skeleton.joint_names == std::vector<std::string>{"ROOT", "Hips", "Spine", "Hips (2)", "Spine (2)"});
  CHECK(skeleton.joint_parents == std::vector<std::int32_t>{-1, 0, 1, 0, 3});
  REQUIRE(skeleton.frame_count == 2);
  const double* const last = skeleton.positions.data() + 3 * 5;
  CHECK(last[3 * 2 + 0] == 0);
  CHECK(last[3 * 2 + 2] == 0);  // the first spine has no keys of its place
  CHECK(last[3 * 4 + 0] == 2);
  CHECK(last[3 * 4 + 2] == 1);
  CHECK(has_note(skeleton, "2 nodes have the name of another, and are called Hips (2), Spine (2)"));
}

TEST_CASE("names are unique whatever they are, and joints keep theirs") {
  // Names that are taken, of nodes that nothing moves, of the root that assimp adds; none; control characters; long.
  MadeGltf made = two_people();
  Json& nodes = made.json["nodes"];
  const std::string long_name(3000, 'x');
  nodes[0]["name"] = "ROOT";
  nodes[1]["name"] = "a\nb";
  nodes[2]["name"] = "a?b";
  nodes[3]["name"] = "a?b (2)";
  nodes[1]["children"] = {4, 5, 6};
  nodes[3]["children"] = {7, 8};
  nodes.push_back(Json::object());
  nodes.push_back({{"name", long_name + "1"}});
  nodes.push_back({{"name", long_name + "2"}});
  nodes.push_back({{"name", ""}});
  nodes.push_back({{"name", "nodes[4]"}});
  made.json["scenes"][0]["nodes"] = {0, 2, 9};
  nodes.push_back({{"name", "a?b (2)"}, {"mesh", 0}});
  made.json["meshes"] = Json::parse(R"([{"primitives": []}])");
  for (const int node : {4, 5, 6, 7, 8})
    made.json["animations"][0]["channels"].push_back({{"sampler", 0}, {"target", {{"node", node}, {"path", "scale"}}}});
  const Skeleton skeleton = motion_of(made);
  std::vector<std::string> names = skeleton.joint_names;
  REQUIRE(names.size() == 10);
  CHECK(names[0] == "ROOT (2)");
  CHECK(names[1] == "ROOT");
  CHECK(names[2] == "a?b");
  CHECK(names[3] == "nodes[4]");
  CHECK(names[5].size() < 300);
  CHECK(names[6] == "a?b (3)");  // node 2, which only node 3 moves
  CHECK(names[7] == "a?b (2)");
  CHECK(names[8] == "nodes[7]");
  CHECK(names[9] == "nodes[4] (2)");
  std::sort(names.begin(), names.end());
  CHECK(std::unique(names.begin(), names.end()) == names.end());
}

TEST_CASE("a mesh that two skins move is there for both") {
  MadeGltf made = two_boxes();
  Json& nodes = made.json["nodes"];
  const std::size_t first = nodes.size();
  nodes.push_back({{"name", "root"}, {"translation", {20, 0, 0}}, {"children", {first + 1}}});
  nodes.push_back({{"name", "arm"}, {"translation", {0, 0, 6}}, {"scale", {2, 2, 2}}});
  nodes.push_back({{"name", "skinned"}, {"mesh", 0}, {"skin", 1}});
  made.json["skins"].push_back(made.json["skins"][0]);
  made.json["skins"][1]["joints"] = {first, first + 1};
  made.json["scenes"][0]["nodes"] = {0, 2, 4, first, first + 2};
  const Skeleton skeleton = skin_of(made);
  CHECK(skeleton.joint_names == std::vector<std::string>{"ROOT", "root", "arm", "root (2)", "arm (2)"});
  const std::size_t vertices = skeleton.skin.vertices.size() / 3;
  REQUIRE(vertices == 16 + 16 + 4 + 4);
  std::vector<std::size_t> moved_by(5, 0);
  for (std::size_t v = 0; v < vertices; ++v)
    ++moved_by[skeleton.skin.bone_joints[skeleton.skin.influence_bones[v * skeleton.skin.influence_count]]];
  CHECK(moved_by == std::vector<std::size_t>{4, 8 + 4, 8, 8, 8});
}

TEST_CASE("a required extension must be known by name, and those that say nothing about shapes are") {
  const auto requires_one = [](const char* extension) {
    return complaint_after([&](MadeGltf& made) { made.json["extensionsRequired"] = Json::array({extension}); });
  };
  for (const char* fine :
       {"KHR_mesh_quantization", "KHR_texture_transform", "KHR_materials_unlit", "KHR_texture_basisu",
        "KHR_lights_punctual", "VRM", "VRMC_vrm", "EXT_texture_webp", "MSFT_lod"})
    CHECK(requires_one(fine).empty());
  CHECK(requires_one("ACME_unknown") == "the extension ACME_unknown is required by the file, but is not supported");
  CHECK(requires_one("EXT_mesh_gpu_instancing").find("EXT_mesh_gpu_instancing is required") != std::string::npos);
  CHECK(requires_one("KHR_materials").find("is required") != std::string::npos);
  CHECK(complaint_after([](MadeGltf& made) { made.json["extensionsRequired"] = {7}; }) ==
        "extensionsRequired must be an array of texts");
  MadeGltf used = two_boxes();
  used.json["extensionsUsed"] = {"EXT_mesh_gpu_instancing", "KHR_materials_unlit", "ACME_unknown"};
  CHECK(has_note(skin_of(used), "EXT_mesh_gpu_instancing: a mesh with many instances is read once"));
  // Compression that is not required, of data that is not there otherwise.
  CHECK(complaint_after([](MadeGltf& made) {
          made.json["meshes"][0]["primitives"][0]["extensions"]["KHR_draco_mesh_compression"] = Json::object();
          made.json["accessors"][kPositions].erase("bufferView");
        }) == "Draco compression (KHR_draco_mesh_compression) is not supported");
  CHECK(complaint_after([](MadeGltf& made) {
          made.json["buffers"].push_back({{"byteLength", 1000}});
          made.json["bufferViews"][0] = {{"buffer", 1}, {"byteLength", 1000}};
        }) == "buffers[1] has no data, which accessors[0] needs");
  CHECK(complaint_after([](MadeGltf& made) {
          made.json["buffers"].push_back({{"byteLength", 1000}});
          made.json["bufferViews"][0] = {{"buffer", 1}, {"byteLength", 1000}};
          made.json["bufferViews"][0]["extensions"]["EXT_meshopt_compression"] = Json::object();
        }) == "meshopt compression (EXT_meshopt_compression) is not supported");
}

TEST_CASE("meshes and skins that are not as the specification says are refused with the place") {
  const auto attribute = [](const char* name, const Json& value) {
    return complaint_after(
        [&](MadeGltf& made) { made.json["meshes"][0]["primitives"][0]["attributes"][name] = value; });
  };
  const std::string primitive = "meshes[0].primitives[0]";
  CHECK(attribute("JOINTS_1", kJoints) == primitive + " has JOINTS_1 without its weights");
  CHECK(attribute("WEIGHTS_1", kWeights) == primitive + " has WEIGHTS_1 without its joints");
  CHECK(attribute("POSITION", 99) == primitive + ".POSITION is 99, but there are 10 accessors");
  CHECK(attribute("POSITION", kWeights) == primitive + ".POSITION must be of VEC3");
  CHECK(attribute("WEIGHTS_0", kPositions) == primitive + ".WEIGHTS_0 must be of VEC4");
  CHECK(attribute("JOINTS_0", kWeights) == "accessors[2] must have unsigned integers");
  const auto accessor = [](std::size_t index, const char* key, const Json& value) {
    return complaint_after([&](MadeGltf& made) { made.json["accessors"][index][key] = value; });
  };
  CHECK(accessor(kWeights, "count", 15) == primitive + ".WEIGHTS_0 has 15 items, but there are 16 vertices");
  CHECK(accessor(kPositions, "componentType", kUnsignedInt) ==
        "accessors[0] must have floats, or integers of 8 or 16 bits");
  CHECK(accessor(kPositions, "count", 4) == primitive + ".indices has the index 15, but there are 4 vertices");
  CHECK(accessor(kMatrices, "count", 1) == "skins[0].inverseBindMatrices has 1 items, 2 are needed");
  CHECK(complaint_after([](MadeGltf& made) { made.json["skins"][0]["joints"] = {0}; }) ==
        primitive + ".JOINTS_0 has joint 1 at vertex 8, but skins[0] has 1");
  CHECK(complaint_after([](MadeGltf& made) {
          std::vector<float> weights = floats_of(made, kWeights);
          weights[5] = std::numeric_limits<float>::quiet_NaN();
          replace_values(made, kWeights, weights, 5126);
        }) == primitive + ".WEIGHTS_0 has a weight that is not finite at vertex 1");
  CHECK(complaint_after([](MadeGltf& made) {
          const std::size_t index = add_view(made, as_bytes(std::vector<std::uint16_t>{16}));
          made.json["accessors"][kPositions]["sparse"] = {
              {"count", 1},
              {"indices", {{"bufferView", index}, {"componentType", kUnsignedShort}}},
              {"values", {{"bufferView", 0}}}};
        }) == "accessors[0].sparse has a value for item 16 of 16");
  CHECK(complaint_after([](MadeGltf& made) {
          made.json["nodes"][1]["scale"] = {1, 1};
        }) == "nodes[1].scale must be 3 numbers");
  CHECK(complaint_after([](MadeGltf& made) {
          made.json["nodes"][1]["scale"] = {1, "1", 1};
        }) == "nodes[1].scale must be 3 numbers");
  CHECK(complaint_after([](MadeGltf& made) {
          made.json["scenes"][0]["nodes"] = {0, 1, 2};
        }) == "scenes[0] has nodes[1], which is a child");
  CHECK(complaint_after([](MadeGltf& made) {
          made.json["nodes"].push_back({{"name", "far"}});
          made.json["skins"][0]["joints"] = {0, 5};
        }) == "skins[0] has the joint nodes[5], which is not in the scene");
  CHECK(complaint_after([](MadeGltf& made) { made.json["meshes"][0]["primitives"][0]["mode"] = 7; }) ==
        primitive + " has the unknown mode 7");
  CHECK(complaint_after([](MadeGltf& made) { made.json["meshes"][0]["primitives"][0]["attributes"] = 7; }) ==
        primitive + " must have attributes");
  CHECK(complaint_after([](MadeGltf& made) { made.json["meshes"][0] = 7; }) == "meshes[0] must be an object");
  CHECK(complaint_after([](MadeGltf& made) {
          made.json["nodes"][1].erase("translation");
          made.json["nodes"][1].erase("scale");
          made.json["nodes"][1]["matrix"] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 6, 1};
        }) == "animations[0] moves nodes[1], which has a matrix: it must have translation, rotation and scale");
  // A name of any length makes no long line.
  CHECK(complaint_after([](MadeGltf& made) {
          made.json["extensionsRequired"] = Json::array({std::string(100000, 'x')});
        }).find("xxx...") != std::string::npos);
}

TEST_CASE("a small file cannot ask for much memory") {
  // 60 meshes of the same 4 million zeros, which no view has: each is 48 MB in assimp.
  const Json zeros = {{"componentType", 5126}, {"count", 4000000}, {"type", "VEC3"}};
  MadeGltf made = two_boxes();
  made.json["accessors"].push_back(zeros);
  for (std::size_t m = 0; m < 60; ++m) {
    made.json["meshes"].push_back({{"primitives", {{{"attributes", {{"POSITION", 10}}}}}}});
    made.json["nodes"].push_back({{"mesh", 2 + m}});
    made.json["scenes"][0]["nodes"].push_back(5 + m);
  }
  const std::string complaint = "its meshes and animations take more than 256 MiB";
  CHECK(complaint_about(made) == complaint);
  // 20 more tracks of the same keys.
  MadeGltf clip = made_gltf({0, 1});
  clip.json["accessors"].push_back(zeros);
  clip.json["animations"][0]["samplers"][0]["output"] = 2;
  for (int track = 0; track < 20; ++track)
    clip.json["animations"][0]["channels"].push_back(clip.json["animations"][0]["channels"][0]);
  CHECK(complaint_about(clip) == complaint);
}

TEST_CASE("channels that move no node are left out, and a file without scenes has all its nodes") {
  MadeGltf made = made_gltf({0, 1});
  const Skeleton plain = motion_of(made);
  made.json["animations"][0]["channels"].push_back({{"sampler", 0}, {"target", {{"path", "scale"}}}});
  made.json["animations"][0]["channels"].push_back({{"sampler", 0}, {"target", {{"path", "pointer"}}}});
  made.json.erase("scene");
  made.json.erase("scenes");
  const Skeleton skeleton = motion_of(made);
  CHECK(skeleton.joint_names == plain.joint_names);
  CHECK(skeleton.positions == plain.positions);
}

TEST_CASE("of cubic splines and steps the keys are read, and notes say that between them motion is straight") {
  MadeGltf made = made_gltf({0, 1, 2});
  const Skeleton plain = motion_of(made);
  made.json["animations"][0]["samplers"][0]["interpolation"] = "STEP";
  const Skeleton steps = motion_of(made);
  CHECK(steps.positions == plain.positions);
  CHECK(has_note(steps, "2 tracks are steps: between their keys, motion is in straight lines"));
  // In-tangent, value, out-tangent.
  std::vector<float> values;
  for (int k = 0; k < 3; ++k)
    for (const float value : {99.0f, 99.0f, 99.0f, 0.0f, 1.0f, static_cast<float>(k), 99.0f, 99.0f, 99.0f})
      values.push_back(value);
  replace_values(made, 1, values, 5126);
  made.json["accessors"][1]["count"] = 9;
  made.json["animations"][0]["samplers"][0]["interpolation"] = "CUBICSPLINE";
  const Skeleton splines = motion_of(made);
  CHECK(splines.positions == plain.positions);
  CHECK(has_note(splines, "2 tracks are cubic splines"));
  made.json["animations"][0]["samplers"][0]["interpolation"] = "WAVY";
  CHECK(complaint_about(made) == "animations[0].samplers[0] has the unknown interpolation WAVY");
}
