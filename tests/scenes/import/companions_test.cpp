// The files that a motion file is read with, as a child process lists them.
#include "scenes/import/companions.h"

#include "scenes/import/import.h"
#include "scenes/import/limits.h"
#include "tests/scenes/temporary_file.h"

#include <doctest/doctest.h>

#include <filesystem>
#include <string>
#include <vector>

namespace {

using namespace cab::scenes;
using cab::tests::TemporaryFile;

// The companions of a file, from its folder on.
std::vector<std::string> companions_of(const std::string& name, const std::string& text) {
  const TemporaryFile file(name, text);
  std::vector<std::string> names;
  for (const std::string& path : companion_files(file.path(), kImportSandbox)) {
    CHECK(std::filesystem::path(path).is_absolute());
    names.push_back(std::filesystem::relative(path, file.directory()).string());
  }
  return names;
}

}  // namespace

TEST_CASE("the companions of a glTF file are the buffers that it names below its folder, each once") {
  const std::string text = R"({"buffers": [{"uri": "a%20b.bin"}, {"uri": "data:x"}, {}, {"uri": "sub/../a b.bin"}, 3,
      {"uri": "../x.bin"}, {"uri": "/etc/passwd"}, {"uri": "http://x/y"}, {"uri": 4}, {"uri": "sub/c.bin"}]})";
  const std::vector<std::string> wanted = {"a b.bin", "sub/c.bin"};
  CHECK((companions_of("a.gltf", text) == wanted));
  CHECK((companions_of("a.vrm", text) == wanted));
  CHECK(companions_of("a.bvh", text).empty());
  CHECK(companions_of("a.gltf", "{}").empty());
  // Version 1 has an object of named buffers.
  CHECK((companions_of("a.gltf", R"({"buffers": {"one": {"uri": "1.bin"}}})") == std::vector<std::string>{"1.bin"}));
}

TEST_CASE("the companion of an MD5 file is its other half, and a file that cannot be read has none") {
  CHECK((companions_of("walk.md5mesh", "x") == std::vector<std::string>{"walk.md5anim"}));
  CHECK((companions_of("walk.MD5ANIM", "x") == std::vector<std::string>{"walk.md5mesh"}));
  CHECK_THROWS_AS(companions_of("a.gltf", std::string(1 << 20, '[')), const ImportError&);
  CHECK_THROWS_AS(companions_of("11_01.amc", "x"), const ImportError&);
  CHECK_THROWS_AS(companion_files("/nonexistent.gltf", kImportSandbox), const ImportError&);
}
