// Bytes as the text of an MJCF file and, after <!--part-->, of a file part.xml beside it, without libmujoco. Each gives
// a text that is XML again, one element a line, or one line that says what is wrong.
#include "scenes/import/printable.h"
#include "scenes/robot/mjcf_text.h"
#include "scenes/robot/mjcf_tree.h"
#include "tests/fuzz/bytes.h"
#include "tests/scenes/temporary_file.h"

#include <algorithm>

namespace {

using namespace cab::scenes;

constexpr std::size_t kMostXmlBytes = std::size_t{16} << 20;  // that XmlText reads

void check(const MjcfText& text) {
  FUZZ_CHECK(text.lines.size() == static_cast<std::size_t>(std::count(text.xml.begin(), text.xml.end(), '\n')));
  for (std::size_t k = 0; k < text.lines.size(); ++k) FUZZ_CHECK(!text.place_of(k).empty());
  for (const std::string& note : text.notes) FUZZ_CHECK(printable(note) == note);
  FUZZ_CHECK(text.xml.rfind("<mujoco", 0) == 0);
  if (text.xml.size() > kMostXmlBytes) return;
  static const cab::tests::TemporaryFile again("again.xml", "");
  std::ofstream(again.path(), std::ios::binary) << text.xml;
  try {
    XmlText{again.path()};
  } catch (const ImportError& error) {
    std::fprintf(stderr, "%s\n", error.what());
    FUZZ_CHECK(false);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const cab::tests::TemporaryFile file("robot.xml", "");
  const std::string bytes(data, data + size), mark = "<!--part-->";
  const std::size_t at = std::min(bytes.find(mark), bytes.size());
  std::ofstream(file.path(), std::ios::binary) << bytes.substr(0, at);
  std::ofstream(file.directory() / "part.xml", std::ios::binary)
      << bytes.substr(std::min(at + mark.size(), bytes.size()));
  RobotOptions options;
  options.ignored_words = {"later"};
  try {
    const XmlText text(file.path());
    for (const std::string& path : mjcf_files(text)) may_open_for_mjcf(path, file.path(), options);
    check(mjcf_text(text, options));
  } catch (const ImportError& error) {
    const std::string line = error.what();
    FUZZ_CHECK(line.rfind(file.path() + ": ", 0) == 0 && printable(line) == line);
  }
  return 0;
}
