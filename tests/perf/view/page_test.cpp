// perf/view/page.h: where the page is looked for, and what becomes of its one line of data.
#include "perf/view/page.h"

#include <doctest/doctest.h>

#include <cstdint>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>
#include <string>

#include "tests/perf/cli/spawn.h"

namespace cab::tests {
namespace {

const std::string kHead = "<!doctype html>\n<p>page</p>\n", kTail = "<p>end</p>\n";

// What stands between two texts.
std::string between(const std::string& text, const std::string& before, const std::string& after) {
  const std::size_t begin = text.find(before);
  REQUIRE(begin != std::string::npos);
  const std::size_t end = text.find(after, begin + before.size());
  REQUIRE(end != std::string::npos);
  return text.substr(begin + before.size(), end - begin - before.size());
}

// Decodes base64, four digits after the other.
std::string from_base64(const std::string& text) {
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  std::uint32_t bits = 0;
  int count = 0;
  for (const char c : text) {
    if (c == '=') break;
    const std::size_t digit = digits.find(c);
    REQUIRE(digit != std::string::npos);
    bits = bits << 6 | static_cast<std::uint32_t>(digit);
    count += 6;
    if (count < 8) continue;
    count -= 8;
    bytes += static_cast<char>(bits >> count & 255);
  }
  return bytes;
}

std::string page_with(const std::string& report, const std::vector<perf::PageRecording>& recordings,
                      const std::function<void(std::uint64_t)>& advance = {}) {
  std::ostringstream out;
  perf::write_page(out, {kHead, kTail}, report, recordings, advance);
  return out.str();
}

TEST_CASE("a page is split at its one line of data") {
  const TemporaryFolder folder;
  const std::string path = folder / "page.html";
  for (const char* const line : {"<!--CAB-DATA-->\n", "  <!--CAB-DATA-->\r\n"}) {
    write_text(path, kHead + line + kTail);
    const perf::Page page = perf::read_page(path);
    CHECK(page.before == kHead);
    CHECK(page.after == kTail);
  }
  write_text(path, kHead + "<!--CAB-DATA-->");
  CHECK(perf::read_page(path).after.empty());
}

TEST_CASE("what is no page is refused, and the message says why") {
  const TemporaryFolder folder;
  const std::string path = folder / "page.html";
  const auto message = [](const std::string& of) {
    try {
      perf::read_page(of);
    } catch (const std::runtime_error& error) { return std::string(error.what()); }
    return std::string();
  };
  write_text(path, kHead + kTail);
  CHECK(message(path) == path + " is no page of the viewer: it has 0 lines <!--CAB-DATA-->, not 1");
  write_text(path, "<!--CAB-DATA-->\n<!--CAB-DATA-->\n");
  CHECK(message(path) == path + " is no page of the viewer: it has 2 lines <!--CAB-DATA-->, not 1");
  CHECK(message(folder / "none") == "cannot read " + folder / "none" + ": No such file or directory");
  CHECK(message(folder / "").find("it is a folder") != std::string::npos);
}

TEST_CASE("recordings of every length come back from base64, byte for byte") {
  const TemporaryFolder folder;
  std::string bytes;
  for (const std::size_t length : {0u, 1u, 2u, 3u, 4u, 255u, 49151u, 49152u, 49153u, 200000u}) {
    while (bytes.size() < length) bytes += static_cast<char>(bytes.size() * 7 + bytes.size() / 251);
    bytes.resize(length);
    const std::string path = folder / "a.cab";
    write_text(path, bytes);
    std::uint64_t told = 0;
    const std::string page = page_with("", {{"a.cab", path}}, [&](std::uint64_t count) { told += count; });
    CHECK(told == length);
    CHECK(from_base64(between(page, "data-name=\"a.cab\">", "</script>")) == bytes);
    CHECK(page.substr(0, kHead.size()) == kHead);
    CHECK(page.substr(page.size() - kTail.size()) == kTail);
    CHECK(page.find("cab-report") == std::string::npos);
  }
}

TEST_CASE("no text of a report and no name of a recording leaves its place") {
  const TemporaryFolder folder;
  const std::string path = folder / "a.cab";
  write_text(path, "x");
  const nlohmann::json report = {{"title", "</script><!-- <script> & \"quoted\""}, {"frames", 3}};
  const std::string page = page_with(report.dump(), {{"\"><b>&\n\xff", path}});
  const std::string text = between(page, "id=\"cab-report\">", "</script>");
  CHECK(text.find('<') == std::string::npos);
  CHECK(nlohmann::json::parse(text) == report);
  CHECK(between(page, "data-name=\"", "\"") == "&quot;&gt;&lt;b&gt;&amp;??");
}

TEST_CASE("a recording that cannot be read is told") {
  CHECK_THROWS_AS(page_with("", {{"a", "/nowhere/a.cab"}}), std::runtime_error);
}

TEST_CASE("the page is found beside an installed command and in a build tree") {
  const TemporaryFolder folder;
  const std::string installed = folder / "usr/bin/cab", built = folder / "build/release/perf/cab";
  CHECK(perf::find_page(installed).empty());
  std::filesystem::create_directories(folder / "usr/share/cab");
  write_text(folder / "usr/share/cab/cab_view.html", "");
  std::filesystem::create_directories(folder / "build/view");
  write_text(folder / "build/view/cab_view.html", "");
  CHECK(perf::find_page(installed) == folder / "usr/share/cab/cab_view.html");
  CHECK(perf::find_page(built) == folder / "build/view/cab_view.html");
  CHECK(perf::find_page(folder / "elsewhere/bin/cab").empty());
}

}  // namespace
}  // namespace cab::tests
