// Files read in a child process: each gives what it gives in this process, or one line, whatever its parser does.
#include "scenes/import/in_child.h"

#include "scenes/import/import_payload.h"
#include "tests/scenes/import/made_gltf.h"
#include "tests/scenes/temporary_file.h"

#include <doctest/doctest.h>

#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>

namespace {

using namespace cab::scenes;
using namespace cab::tests;

// A good file of the corpus takes less than 0.1 s and 50 MiB.
constexpr SandboxLimits kLimits = {std::size_t{1} << 30, 2, 300, std::size_t{256} << 20};

ImportOptions in_child() {
  ImportOptions options;
  options.sandbox = kLimits;
  return options;
}

// The complaint of an import in a child, empty if it reads the file. Checks that it is one line that names the file.
std::string complaint(const std::string& path) {
  try {
    import_clip(path, in_child());
  } catch (const ImportError& error) {
    const std::string line = error.what();
    CHECK(line.rfind(path + ": ", 0) == 0);
    CHECK(printable(line) == line);
    return line.substr(std::min(line.size(), path.size() + 2));
  }
  return {};
}

std::string complaint_about(const std::string& bytes, const std::string& file_name) {
  const TemporaryFile file(file_name, bytes);
  return complaint(file.path());
}

std::string repeated(const std::string& text, int count) {
  std::string all;
  all.reserve(text.size() * static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) all += text;
  return all;
}

std::string read_bytes(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

const std::string kBvh =
    "HIERARCHY\nROOT hips\n{\n  OFFSET 0 0 0\n  CHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation "
    "Xrotation\n"
    "  JOINT leg\n  {\n    OFFSET 0 -1 0\n    CHANNELS 3 Zrotation Yrotation Xrotation\n    End Site\n    {\n"
    "      OFFSET 0 -1 0\n    }\n  }\n}\nMOTION\nFrames: 3\nFrame Time: .01\n" +
    repeated("1 2 3 10 20 30 40 50 60\n", 3);

}  // namespace

TEST_CASE("a file gives the same skeleton in a child as in this process") {
  const TemporaryFile bvh("made.bvh", kBvh), gltf("made.glb", glb(made_gltf({0, 1, 2})));
  for (const std::string& path : {bvh.path(), gltf.path()}) {
    CAPTURE(path);
    CHECK((skeleton_payload(import_skeleton(path, {})) == skeleton_payload(import_skeleton(path, in_child()))));
  }
}

TEST_CASE("a complaint comes back from the child as it is made in this process") {
  CHECK(complaint("/nonexistent.bvh") == "no such file");
  CHECK(complaint("/tmp") == "is a directory, not a file");
  CHECK(complaint("") == "no such file");
  CHECK(complaint_about("HIERARCHY\nROOT\n", "clip.bvh") == "line 2: expected the name of a joint");
}

TEST_CASE("a reader that crashes, hangs, allocates or throws gives one line with the file's name") {
  const auto line = [](const std::function<std::string()>& read) -> std::string {
    SandboxLimits limits = kLimits;
    limits.cpu_seconds = 1;
    try {
      from_child("walk\n.fbx", limits, read, read_skeleton_payload);
    } catch (const ImportError& error) { return error.what(); }
    return {};
  };
  CHECK(line([]() -> std::string {
          raise(SIGSEGV);
          return {};
        }) == "walk?.fbx: reading it crashed: Segmentation fault");
  CHECK(line([]() -> std::string {
          for (std::uint64_t turns = 0;; ++turns) getppid();
        }) == "walk?.fbx: reading it took more than 1 s of processor time");
  if (sandbox_limits_memory()) {
    CHECK(line([] { return repeated(repeated("x", 1 << 20), 4096); }) ==
          "walk?.fbx: reading it needs more than 1024 MiB of memory");
  }
  CHECK(line([]() -> std::string { throw std::length_error("too long\nfor it"); }) ==
        "walk?.fbx: cannot be read: too long?for it");
  CHECK(line([] { return std::string("rubbish"); }) ==
        "walk?.fbx: reading it gave a damaged result: the bytes end too early");
}

TEST_CASE("the file that a child read when it was stopped is named") {
  CurrentFile current;
  const auto line = [&](const std::string& named, const std::function<std::string()>& then) -> std::string {
    current.set({});
    const auto read = [&] {
      current.set(named);
      return then();
    };
    try {
      from_child("r.urdf", kLimits, read, read_skeleton_payload, {{}, &current});
    } catch (const ImportError& error) { return error.what(); }
    return {};
  };
  const auto crash = []() -> std::string {
    raise(SIGSEGV);
    return {};
  };
  CHECK(line("arm\n.stl", crash) == "r.urdf: reading it crashed: Segmentation fault, in arm?.stl");
  CHECK(line({}, crash) == "r.urdf: reading it crashed: Segmentation fault");
  const std::string long_line = line(std::string(5000, 'x') + ".stl", crash);
  CHECK(long_line.rfind("r.urdf: reading it crashed: Segmentation fault, in xxx", 0) == 0);
  CHECK(long_line.size() <= 300);
  CHECK(line("arm.stl", []() -> std::string { throw ImportError("r.urdf: no"); }) == "r.urdf: no");
}

TEST_CASE("a child can open what it is given besides the file's folder") {
  const TemporaryFile file("r.urdf", "robot"), other("arm.stl", "mesh");
  const auto read = [&](const ChildFiles& more) {
    return from_child(
        file.path(), kLimits, [&] { return read_bytes(other.path()); }, [](const std::string& bytes) { return bytes; },
        more);
  };
  CHECK(read({{other.path()}, nullptr}) == "mesh");
  if (sandbox_limits_files()) CHECK(read({}).empty());
}

TEST_CASE("what the child had to do without is a note of the result") {
  struct Noted {
    std::vector<std::string> notes;
  } result;
  note_unprotected(result, "", 0);
  CHECK(result.notes.empty());
  note_unprotected(result, "Landlock", 0);
  REQUIRE(result.notes.size() == 1);
  CHECK(result.notes[0] == "it was read in a child process without Landlock, which this system lacks or forbids");
}

// What assimp 5.2.5 does with each in the same process, with a stack of 8 MB, is in the comments.
TEST_CASE("inputs that assimp does not survive cost one line") {
  // Segmentation faults, by recursion.
  CHECK(!complaint_about("{\"extras\":" + std::string(180000, '[') + std::string(180000, ']') + "}", "deep.gltf")
             .empty());
  CHECK(!complaint_about(R"(<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" )"
                         R"(version="1.4.1"><asset><up_axis>Y_UP</up_axis></asset><library_visual_scenes>)"
                         R"(<visual_scene id="s">)" +
                             repeated("<node>", 20000) + repeated("</node>", 20000) +
                             R"(</visual_scene></library_visual_scenes><scene><instance_visual_scene url="#s"/>)"
                             R"(</scene></COLLADA>)",
                         "deep.dae")
             .empty());
  CHECK(!complaint_about("xof 0303txt 0032\n" + repeated("Frame f {\n", 100000) + repeated("}\n", 100000), "deep.x")
             .empty());
  CHECK(
      !complaint_about("; FBX 7.3.0 project file\n" + repeated("a: {\n", 100000) + repeated("}\n", 100000), "deep.fbx")
           .empty());
  // A segmentation fault, a segmentation fault, and no end within 10 s: found by libFuzzer.
  for (const char* name : {"clip.ase", "clip.mdl", "clip.smd"}) {
    CAPTURE(name);
    const std::string path = std::string(CAB_DOCS) + "/../tests/fuzz/assimp/" + name;
    REQUIRE(std::filesystem::exists(path));
    CHECK(!complaint(path).empty());
  }
}
