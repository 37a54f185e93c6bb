// Bytes as a glTF file: it is refused with one line, or what assimp gets instead is a good file, which is the same when
// it is written anew. A GLB is not taken for text.
#include "scenes/import/gltf_file.h"
#include "scenes/import/import.h"
#include "scenes/import/printable.h"
#include "tests/fuzz/bytes.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace cab;
  const std::string bytes(reinterpret_cast<const char*>(data), size);
  try {
    const scenes::GltfForAssimp prepared = scenes::prepare_gltf(bytes, "/nonexistent/clip.gltf", "clip.gltf");
    FUZZ_CHECK(prepared.is_binary == (bytes.rfind("glTF", 0) == 0));
    for (const std::string& note : prepared.notes) FUZZ_CHECK(scenes::printable(note) == note);
    if (!prepared.glb.empty())
      FUZZ_CHECK(scenes::prepare_gltf(prepared.glb, "/nonexistent/new.glb", "new.glb").glb == prepared.glb);
  } catch (const scenes::ImportError& error) {
    const std::string line = error.what();
    FUZZ_CHECK(line.size() <= 300);
    FUZZ_CHECK(line.rfind("clip.gltf: ", 0) == 0 && scenes::printable(line) == line);
  }
  return 0;
}
