// Turns bytes into a BVH file, which goes through import's own check, Debian's assimp, links, a world
// and an engine.
#include "scenes/import/import.h"
#include "scenes/import/printable.h"
#include "tests/fuzz/bytes.h"
#include "tests/fuzz/taken_by_engine.h"
#include "tests/scenes/temporary_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace cab;
  static const tests::TemporaryFile file("clip.bvh", "");
  std::ofstream(file.path(), std::ios::binary)
      .write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
  try {
    fuzz::taken_by_engine(scenes::make_world({scenes::import_clip(file.path(), {})}));
  } catch (const scenes::ImportError& error) {
    const std::string line = error.what();
    FUZZ_CHECK(line.rfind(file.path() + ": ", 0) == 0 && scenes::printable(line) == line);
  }
  return 0;
}
