// Bytes as a file of the format that the first byte chooses, read in a child process: a world that an engine takes, or
// one line, whatever assimp does in the child.
#include "scenes/import/import.h"
#include "scenes/import/printable.h"
#include "tests/fuzz/bytes.h"
#include "tests/fuzz/taken_by_engine.h"
#include "tests/scenes/temporary_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace cab;
  constexpr const char* kExtensions[] = {"bvh",     "gltf", "glb", "vrm", "fbx", "dae", "x",   "md5mesh",
                                         "md5anim", "ms3d", "smd", "b3d", "mdl", "ase", "obj", "ogex"};
  fuzz::Bytes bytes(data, size);
  const std::string name = std::string("clip.") + kExtensions[bytes.below(16)];
  const tests::TemporaryFile file(name, bytes.rest());
  scenes::ImportOptions options;
  options.sandbox = scenes::SandboxLimits{std::size_t{1} << 30, 2, 60, std::size_t{64} << 20};
  try {
    fuzz::taken_by_engine(scenes::make_world({scenes::import_clip(file.path(), options)}));
  } catch (const scenes::ImportError& error) {
    const std::string line = error.what();
    FUZZ_CHECK(line.rfind(file.path() + ": ", 0) == 0 && scenes::printable(line) == line);
  }
  return 0;
}
