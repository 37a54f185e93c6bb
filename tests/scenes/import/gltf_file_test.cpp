// glTF as it is written: clocks, names and containers; and what the check refuses before assimp sees it.
#include "scenes/import/gltf_file.h"

#include "scenes/import/import.h"
#include "tests/scenes/import/made_gltf.h"
#include "tests/scenes/temporary_file.h"

#include <doctest/doctest.h>

#include <filesystem>
#include <fstream>
#include <functional>

namespace {

using namespace cab::scenes;
using namespace cab::tests;

std::vector<float> seconds(int first, int last, float per_key) {
  std::vector<float> times;
  for (int k = first; k <= last; ++k) times.push_back(static_cast<float>(k) * per_key);
  return times;
}

Skeleton skeleton_of(const std::string& bytes, const std::string& file_name) {
  const TemporaryFile file(file_name, bytes);
  return import_skeleton(file.path(), {});
}

// The complaint about a file, without its name; empty if it is read.
std::string complaint_about(const std::string& bytes, const std::string& file_name) {
  const TemporaryFile file(file_name, bytes);
  try {
    import_skeleton(file.path(), {});
  } catch (const ImportError& error) {
    const std::string line = error.what();
    REQUIRE(line.rfind(file.path() + ": ", 0) == 0);
    CHECK(line.find('\n') == std::string::npos);
    return line.substr(file.path().size() + 2);
  }
  return {};
}

// The complaint about the made file after a change, as text and as a GLB, which must be the same.
std::string complaint_after(const std::function<void(MadeGltf& made)>& change) {
  MadeGltf made = made_gltf({0, 1});
  change(made);
  const std::string text = complaint_about(gltf_text(made), "clip.gltf");
  CHECK(complaint_about(glb(made), "clip.glb") == text);
  return text;
}

bool has_note(const Skeleton& skeleton, const std::string& text) {
  for (const std::string& note : skeleton.notes) {
    if (note.find(text) != std::string::npos) return true;
  }
  return false;
}

}  // namespace

TEST_CASE("the clock of a glTF file is that of its own tracks, also if they start at 1/30 s and some are missing") {
  const Skeleton skeleton = skeleton_of(gltf_text(made_gltf(seconds(1, 94, 1.0f / 30))), "clip.gltf");
  CHECK(skeleton.frame_count == 94);
  // The times are floats: 94/30 s is known to 1e-7 s.
  CHECK(skeleton.frame_seconds == doctest::Approx(1.0 / 30).epsilon(1e-6));
  // Frame f is key f: the places of a and b along z. Below them is c, which has no track.
  REQUIRE(skeleton.joint_names == std::vector<std::string>{"a", "b", "c"});
  for (std::size_t f = 0; f < 94; ++f) {
    CHECK(skeleton.positions[9 * f + 2] == doctest::Approx(static_cast<double>(f)).epsilon(1e-5));
    CHECK(skeleton.positions[9 * f + 5] == doctest::Approx(2 * static_cast<double>(f)).epsilon(1e-5));
  }
}

TEST_CASE("a track of two keys has no say in the step of the clock, but in its length") {
  MadeGltf made = made_gltf(seconds(0, 30, .05f));
  // A second sampler, of the first two keys' places, at 0 and 3 s.
  const std::size_t at = made.bin.size();
  made.bin += bytes_of({0, 3});
  made.json["buffers"][0]["byteLength"] = made.bin.size();
  made.json["bufferViews"].push_back(Json::parse(R"({"buffer": 0, "byteLength": 8})"));
  made.json["bufferViews"][2]["byteOffset"] = at;
  made.json["accessors"].push_back(Json::parse(R"({"bufferView": 2, "componentType": 5126, "count": 2,
                                                   "type": "SCALAR"})"));
  made.json["animations"][0]["samplers"].push_back(Json::parse(R"({"input": 2, "output": 1})"));
  made.json["animations"][0]["channels"][1]["sampler"] = 1;
  const Skeleton skeleton = skeleton_of(glb(made), "clip.glb");
  CHECK(skeleton.frame_seconds == doctest::Approx(.05).epsilon(1e-6));
  CHECK(skeleton.frame_count == 61);
}

TEST_CASE("a GLB is read by what it holds, and a name that says otherwise is noted") {
  const MadeGltf made = made_gltf({0, 1});
  for (const char* name : {"clip.glb", "clip.vrm", "clip.VRM"}) {
    const Skeleton skeleton = skeleton_of(glb(made), name);
    CHECK(skeleton.frame_count == 2);
    CHECK(!has_note(skeleton, "name ends"));
  }
  CHECK(has_note(skeleton_of(glb(made), "clip.gltf"), "the file is a GLB, though its name ends in .gltf"));
  CHECK(has_note(skeleton_of(gltf_text(made), "clip.glb"), "the file is glTF text, though its name ends in .glb"));
  CHECK(!has_note(skeleton_of(gltf_text(made), "clip.gltf"), "name ends"));
  CHECK(skeleton_of(glb(made), "clip.fbx").frame_count == 2);
}

TEST_CASE("the header and the chunks of a GLB must lie in the file, whatever its name says") {
  const std::string good = glb(made_gltf({0, 1}));
  const auto with_word = [&good](std::size_t at, std::uint32_t number) {
    std::string bytes = good;
    return bytes.replace(at, 4, little_endian(number));
  };
  const std::size_t bin = good.find(std::string("BIN\0", 4)) - 4;
  for (const char* name : {"clip.glb", "clip.gltf", "clip.vrm", "clip.obj"}) {
    CAPTURE(name);
    CHECK(complaint_about(with_word(4, 9), name) == "GLB version 9, only 1 and 2 are supported");
    CHECK(complaint_about(with_word(8, 0xfffffff0u), name).find("says 4294967280 bytes, the file has") !=
          std::string::npos);
    CHECK(complaint_about(with_word(12, 0x7ffffff0u), name).find("chunk 0 of the GLB has 2147483632 bytes") == 0);
    // assimp 5.2.5 takes 4.1 GB for it.
    CHECK(complaint_about(with_word(bin, 0xfffffff0u), name).find("chunk 1 of the GLB has 4294967280 bytes") == 0);
    CHECK(complaint_about(with_word(16, 0x004e4942), name) == "chunk 0 of the GLB is not JSON");
    CHECK(complaint_about(good.substr(0, 9), name) == "the file ends in the header of the GLB");
  }
  std::string version_1 = with_word(4, 1);
  CHECK(complaint_about(version_1, "clip.glb") == "the content of the GLB is not JSON");
}

TEST_CASE("a GLB cut off after any byte is refused") {
  const std::string good = glb(made_gltf({0, 1}));
  for (std::size_t size = 1; size < good.size(); ++size) {
    CAPTURE(size);
    CHECK(!complaint_about(good.substr(0, size), "clip.glb").empty());
  }
}

TEST_CASE("offsets, lengths, counts and strides of views and accessors are checked") {
  const auto after = [](const char* list, std::size_t index, const char* key, const Json& value) {
    return complaint_after([&](MadeGltf& made) { made.json[list][index][key] = value; });
  };
  CHECK(complaint_after([](MadeGltf&) {}).empty());
  CHECK(after("accessors", 0, "byteOffset", -4) ==
        "accessors[0].byteOffset must be a whole number that is not negative");
  CHECK(after("bufferViews", 1, "byteOffset", -8) ==
        "bufferViews[1].byteOffset must be a whole number that is not negative");
  CHECK(after("bufferViews", 1, "byteOffset", 1.5) ==
        "bufferViews[1].byteOffset must be a whole number that is not negative");
  CHECK(after("bufferViews", 1, "byteOffset", 12) == "bufferViews[1] ends at byte 36 of a buffer of 32 bytes");
  CHECK(after("bufferViews", 1, "byteLength", 1e9) ==
        "bufferViews[1].byteLength must be a whole number that is not negative");
  CHECK(after("bufferViews", 1, "byteLength", 1000000000000) == "bufferViews[1].byteLength is out of range");
  CHECK(after("bufferViews", 1, "byteLength", 23) == "accessors[1] ends at byte 24 of a buffer view of 23 bytes");
  CHECK(after("bufferViews", 1, "byteStride", 4) == "accessors[1] has a stride of 4 bytes, its items have 12");
  CHECK(after("bufferViews", 1, "byteStride", 16) == "accessors[1] ends at byte 28 of a buffer view of 24 bytes");
  CHECK(after("bufferViews", 1, "buffer", 1) == "bufferViews[1].buffer is 1, but there are 1 buffers");
  CHECK(after("accessors", 1, "bufferView", 2) == "accessors[1].bufferView is 2, but there are 2 bufferViews");
  CHECK(after("accessors", 1, "count", 3) == "accessors[1] ends at byte 36 of a buffer view of 24 bytes");
  CHECK(after("accessors", 1, "count", 4000000000u) == "accessors[1] has 4000000000 items, too many");
  CHECK(after("accessors", 1, "byteOffset", 4) == "accessors[1] ends at byte 28 of a buffer view of 24 bytes");
  CHECK(after("accessors", 1, "componentType", 7) == "accessors[1] has the unknown componentType 7");
  CHECK(after("accessors", 1, "type", "VEC5") == "accessors[1] has no known type");
  CHECK(
      after("accessors", 1, "type", "SCALAR") ==
      "animations[0].samplers[0].output must be of VEC3 in floats or in integers of 8 or 16 bits; other types are not "
      "supported");
  CHECK(after("accessors", 0, "count", 1).empty());  // a place too many does no harm
  CHECK(after("accessors", 1, "count", 1) == "animations[0].samplers[0].output has 1 items, 2 are needed");
  CHECK(after("buffers", 0, "byteLength", 40).find("buffers[0] has 40 bytes, but only 32 are there") == 0);
  CHECK(after("accessors", 1, "sparse", Json::object()) == "accessors[1].sparse must have indices and values");
  const Json sparse = Json::parse(R"({"count": 2, "indices": {"bufferView": 0, "byteOffset": 6, "componentType": 5123},
                                      "values": {"bufferView": 1}})");
  CHECK(after("accessors", 1, "sparse", sparse) ==
        "accessors[1].sparse.indices ends at byte 10 of a buffer view of 8 "
        "bytes");
}

TEST_CASE("nodes that are no tree, or that name what is not there, are refused") {
  const auto children = [](std::size_t node, const Json& list) {
    return complaint_after([&](MadeGltf& made) { made.json["nodes"][node]["children"] = list; });
  };
  CHECK(children(2, Json::array({3})) == "nodes[2].children is 3, but there are 3 nodes");
  CHECK(children(2, Json::array({-1})) == "nodes[2].children must be a whole number that is not negative");
  CHECK(children(0, Json::array({1, 1})) == "nodes[0] has the child 1, which is a child already");
  CHECK(children(0, Json::array({1, 2})) == "nodes[1] has the child 2, which is a child already");
  CHECK(children(2, Json::array({0})) == "nodes[0] is below itself");
  CHECK(children(2, "a") == "nodes[2].children must be an array");
  CHECK(complaint_after([](MadeGltf& made) {
          made.json["scenes"][0]["nodes"] = Json::array({0, 0});
        }) == "scenes[0] has the node 0 twice");
  CHECK(complaint_after([](MadeGltf& made) { made.json["animations"][0]["channels"][0]["sampler"] = 1; }) ==
        "animations[0].channels[0] has no sampler");
  CHECK(complaint_after([](MadeGltf& made) { made.json["animations"][0]["channels"][0]["target"]["node"] = 9; }) ==
        "animations[0].channels[0].target.node is 9, but there are 3 nodes");
  CHECK(complaint_after([](MadeGltf& made) {
          made.json["skins"] = Json::parse(R"([{"joints": [0, 1, 2], "inverseBindMatrices": 1}])");
        }) == "skins[0].inverseBindMatrices must be of MAT4 in floats; other types are not supported");
}

TEST_CASE("deep nodes and deep JSON are refused without recursion") {
  MadeGltf made = made_gltf({0, 1});
  for (std::size_t n = 2; n < 30000; ++n) {
    made.json["nodes"][n]["children"] = Json::array({n + 1});
    made.json["nodes"].push_back(Json::object());
  }
  CHECK(complaint_about(gltf_text(made), "clip.gltf").find("is nested more than 1024 deep") != std::string::npos);
  const std::string deep = "{\"extras\":" + std::string(300000, '[') + std::string(300000, ']') + "}";
  CHECK(complaint_about(deep, "clip.gltf") == "its JSON is nested more than 256 deep");
  // Forty levels of a child that is listed twice would be 2^40 nodes.
  MadeGltf twice = made_gltf({0, 1});
  for (std::size_t n = 2; n < 42; ++n) {
    twice.json["nodes"][n]["children"] = Json::array({n + 1, n + 1});
    twice.json["nodes"].push_back(Json::object());
  }
  CHECK(complaint_about(gltf_text(twice), "clip.gltf") == "nodes[2] has the child 3, which is a child already");
}

TEST_CASE("compression and versions that cannot be read are named") {
  CHECK(complaint_after([](MadeGltf& made) {
          made.json["extensionsRequired"] = Json::array({"KHR_draco_mesh_compression"});
        }) == "Draco compression (KHR_draco_mesh_compression) is not supported");
  CHECK(complaint_after([](MadeGltf& made) {
          made.json["extensionsRequired"] = Json::array({"EXT_meshopt_compression"});
        }) == "meshopt compression (EXT_meshopt_compression) is not supported");
  // A file that can be read without it is read.
  CHECK(complaint_after([](MadeGltf& made) {
          made.json["extensionsUsed"] = Json::array({"KHR_draco_mesh_compression"});
        }).empty());
  CHECK(complaint_after([](MadeGltf& made) { made.json["asset"]["version"] = "3.0"; }) ==
        "asset.version is 3.0, only 1 and 2 are supported");
  CHECK(complaint_after([](MadeGltf& made) { made.json.erase("asset"); }) == "asset.version is missing");
}

TEST_CASE("broken JSON is refused at its byte") {
  CHECK(complaint_about("{\"asset\":", "clip.gltf") == "its JSON is broken at byte 10");
  CHECK(complaint_about("[]", "clip.gltf") == "its JSON is not an object");
  CHECK(complaint_about("{\"asset\":1e999}", "clip.gltf") == "its JSON has a number that is out of range");
}

TEST_CASE("a buffer in another file is read below the folder and refused elsewhere") {
  MadeGltf made = made_gltf({0, 1});
  const auto with_uri = [&made](const std::string& uri) {
    made.json["buffers"][0]["uri"] = uri;
    return made.json.dump();
  };
  const TemporaryFile file("clip.gltf", with_uri("parts/clip.bin"));
  std::filesystem::create_directory(file.directory() / "parts");
  const auto write_bin = [&](const std::string& bytes) {
    std::ofstream((file.directory() / "parts" / "clip.bin").string(), std::ios::binary) << bytes;
  };
  write_bin(made.bin);
  CHECK(import_skeleton(file.path(), {}).frame_count == 2);
  write_bin(made.bin.substr(1));
  CHECK_THROWS_WITH_AS(import_skeleton(file.path(), {}),
                       (file.path() + ": buffers[0] has 32 bytes, but only 31 are there").c_str(), ImportError);
  CHECK(complaint_about(with_uri("clip.bin"), "clip.gltf") ==
        "buffers[0] is in \"clip.bin\": No such file or directory");
  for (const char* outside : {"../clip.bin", "parts/../../clip.bin", "/etc/passwd", "file:///etc/passwd"}) {
    CHECK(complaint_about(with_uri(outside), "clip.gltf") ==
          "buffers[0] is in \"" + std::string(outside) + "\", which is not below the file's folder");
  }
}

TEST_CASE("names of other files are percent-encoded, and may leave the folder in no spelling") {
  MadeGltf made = made_gltf({0, 1});
  const auto with_uri = [&made](const std::string& uri) {
    made.json["buffers"][0]["uri"] = uri;
    return made.json.dump();
  };
  // The folder's own % means itself.
  const TemporaryFile place("unused", "x");
  const std::filesystem::path folder = place.directory() / "100%20x";
  std::filesystem::create_directories(folder / "my parts");
  const std::string clip = (folder / "clip.gltf").string();
  const auto complaint = [&](const std::string& uri) -> std::string {
    std::ofstream(clip, std::ios::binary) << with_uri(uri);
    try {
      const Skeleton skeleton = import_skeleton(clip, {});
      CHECK(skeleton.positions[11] == 1);  // of key 1, from the bytes
    } catch (const ImportError& error) { return std::string(error.what()).substr(clip.size() + 2); }
    return {};
  };
  std::ofstream((folder / "my parts" / "m\xc3\xa9sh%.bin").string(), std::ios::binary) << made.bin;
  for (const char* good : {"my%20parts/m%C3%A9sh%25.bin", "my%20parts/m%c3%a9sh%25.bin",
                           "my parts%2fm\xc3\xa9sh%25.bin", "%6dy%20parts/%2E/m%C3%A9sh%25.bin"}) {
    CAPTURE(good);
    CHECK(complaint(good).empty());
  }
  // A file beside the folder, which is there.
  std::ofstream((place.directory() / "clip.bin").string(), std::ios::binary) << made.bin;
  for (const char* outside : {"%2e%2e%2fclip.bin", "%2E%2e/clip.bin", "..%2Fclip.bin", "my%20parts/%2e%2e/../clip.bin",
                              "%2fetc/passwd", "file%3A//etc/passwd", "%2e%2e"}) {
    CAPTURE(outside);
    CHECK(complaint(outside) ==
          "buffers[0] is in \"" + std::string(outside) + "\", which is not below the file's folder");
  }
  // Decoded once: this is the name "%2e%2e".
  CHECK(complaint("%252e%252e/clip.bin") == "buffers[0] is in \"%252e%252e/clip.bin\": No such file or directory");
  for (const char* malformed : {"%", "my%2", "my%2gparts", "my%-1parts", "my%%20parts", "clip.bin%00", "100%.bin"}) {
    CAPTURE(malformed);
    CHECK(complaint(malformed) == "buffers[0] is in \"" + std::string(malformed) +
                                      "\", in which a % is not followed by two hexadecimal digits of a character");
  }
  made.json["images"] = Json::parse(R"([{"uri": "my%20skin.png"}, {"uri": "%2e%2e%2fskin.png"}])");
  CHECK(complaint("my%20parts/m%C3%A9sh%25.bin").empty());  // images are not read
}
