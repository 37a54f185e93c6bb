// Bytes as a glTF file: the check reads them or refuses them with one line, and takes no GLB for text.
#include "scenes/import/gltf_file.h"
#include "scenes/import/import.h"
#include "scenes/import/printable.h"
#include "tests/fuzz/bytes.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace cab;
  const std::string bytes(reinterpret_cast<const char*>(data), size);
  try {
    const bool is_binary = scenes::check_gltf(bytes, "/nonexistent/clip.gltf", "clip.gltf");
    FUZZ_CHECK(is_binary == (bytes.rfind("glTF", 0) == 0));
  } catch (const scenes::ImportError& error) {
    const std::string line = error.what();
    FUZZ_CHECK(line.rfind("clip.gltf: ", 0) == 0 && scenes::printable(line) == line);
  }
  return 0;
}
