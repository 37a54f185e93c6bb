#include "tests/fuzz/archive.h"

#include <doctest/doctest.h>

#include <cstdio>
#include <string>
#include <vector>

namespace {

using cab::fuzz::ArchiveFile;
using cab::fuzz::files_of_archive;

constexpr std::size_t kBlock = 512;
const std::string kEnd(2 * kBlock, '\0');

// One file of an archive, or what `type` stands for.
std::string packed(const std::string& name, const std::string& bytes, char type = '0') {
  std::string block(kBlock, '\0');
  const auto put = [&](std::size_t at, const std::string& text) { block.replace(at, text.size(), text); };
  const auto octal = [](int digits, std::size_t value) {
    char text[16];
    std::snprintf(text, sizeof text, "%0*zo", digits, value);
    return std::string(text);
  };
  put(0, name);
  put(124, octal(11, bytes.size()));
  put(148, "        ");
  put(156, {type});
  put(257, std::string("ustar\0", 6) + "00");
  std::size_t sum = 0;
  for (const char c : block) sum += static_cast<unsigned char>(c);
  put(148, octal(6, sum) + '\0');
  const std::string padding((kBlock - bytes.size() % kBlock) % kBlock, '\0');
  return block + bytes + padding;
}

// What is wrong with these bytes, without the path that begins the text; or nothing.
std::string fault(const std::string& bytes) {
  try {
    files_of_archive("some.tar", bytes);
  } catch (const std::runtime_error& error) {
    const std::string text = error.what(), begin = "some.tar: ";
    REQUIRE(text.rfind(begin, 0) == 0);
    return text.substr(begin.size());
  }
  return "";
}

}  // namespace

TEST_CASE("files come out of an archive as they went in, whatever their sizes") {
  std::vector<ArchiveFile> wanted = {{"empty", ""}, {std::string(100, 'n'), "x"}, {"zeros", std::string(3000, '\0')}};
  for (const std::size_t size : {std::size_t{511}, kBlock, std::size_t{513}, 10 * kBlock})
    wanted.push_back({std::to_string(size), std::string(size, '\xff')});
  std::string bytes;
  for (const auto& [name, text] : wanted) bytes += packed(name, text);
  for (const std::string& end : {kEnd, kEnd + kEnd}) {
    const std::vector<ArchiveFile> files = files_of_archive("some.tar", bytes + end);
    REQUIRE(files.size() == wanted.size());
    for (std::size_t i = 0; i < files.size(); ++i) {
      CHECK(files[i].name == wanted[i].name);
      CHECK(files[i].bytes == wanted[i].bytes);
    }
  }
}

TEST_CASE("an archive that is cut short anywhere is an error that names it") {
  const std::string bytes = packed("a", "some bytes") + packed("b", "") + kEnd;
  REQUIRE(fault(bytes).empty());
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    CAPTURE(size);
    CHECK(!fault(bytes.substr(0, size)).empty());
  }
}

TEST_CASE("a damaged header is an error that says where it is") {
  const std::string first = packed("a", "some bytes"), second = packed("b", "");
  for (std::size_t at = 0; at < kBlock; ++at) {
    if (at == 154 || at == 155) continue;  // behind the checksum's digits
    CAPTURE(at);
    std::string damaged = second;
    damaged[at] = static_cast<char>(damaged[at] ^ 1);
    CHECK(fault(first + damaged + kEnd).rfind("byte 1024: ", 0) == 0);
  }
  CHECK(fault(first + second + kEnd + "behind the end").rfind("byte ", 0) == 0);
  CHECK(fault("no archive") == "byte 0: the header is cut short");
}

TEST_CASE("whatever is not a plain file is an error") {
  for (const char type : {'1', '2', '5', 'L', 'x'}) {
    CAPTURE(type);
    CHECK(fault(packed("a", "", type) + kEnd) == "byte 0: not a plain file");
  }
}
