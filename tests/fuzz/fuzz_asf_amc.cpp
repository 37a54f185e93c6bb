// Bytes as the texts of an ASF and an AMC file, with a zero byte between them: a world that an engine takes, or one
// line.
#include "scenes/import/asf_amc.h"
#include "scenes/import/import.h"
#include "scenes/import/printable.h"
#include "tests/fuzz/bytes.h"
#include "tests/fuzz/taken_by_engine.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace cab;
  const std::string bytes(reinterpret_cast<const char*>(data), size);
  const std::size_t end = bytes.find('\0');
  const scenes::NamedText asf = {"clip.asf", bytes.substr(0, end)};
  try {
    const scenes::Skeleton skeleton = end == std::string::npos
                                          ? scenes::read_asf(asf, {})
                                          : scenes::read_asf_amc(asf, {"clip.amc", bytes.substr(end + 1)}, {});
    fuzz::taken_by_engine(scenes::make_world({scenes::make_clip(skeleton, "clip.asf", {})}));
  } catch (const scenes::ImportError& error) {
    const std::string line = error.what();
    FUZZ_CHECK(line.rfind("clip.a", 0) == 0 && scenes::printable(line) == line);
  }
  return 0;
}
