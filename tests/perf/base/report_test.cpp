// perf/base/report.h: how long a run still takes, and texts for tables and CSV files.
#include "perf/base/report.h"

#include <doctest/doctest.h>
#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

#include "tests/perf/cli/spawn.h"

namespace cab::tests {
namespace {

using perf::time_left;

TEST_CASE("the time left is what the average so far asks for, in coarse units") {
  CHECK(time_left(50, 100, 10) == "about 10 s left");
  CHECK(time_left(90, 100, 10) == "about 5 s left");
  CHECK(time_left(1, 2, 55) == "about 55 s left");
  CHECK(time_left(1, 2, 57) == "about 1 min left");
  CHECK(time_left(10, 100, 20) == "about 3 min left");
  CHECK(time_left(10, 100, 21) == "about 4 min left");
  CHECK(time_left(1, 2, 3540) == "about 59 min left");
  CHECK(time_left(1, 2, 3599) == "about 1 h left");
  CHECK(time_left(1, 2, 3601) == "about 2 h left");
}

TEST_CASE("nothing is said too early, at the end and of no work") {
  CHECK(time_left(50, 100, 1.9).empty());
  CHECK(time_left(9, 1000, 100).empty());
  CHECK(time_left(0, 100, 100).empty());
  CHECK(time_left(100, 100, 100).empty());
  CHECK(time_left(0, 0, 100).empty());
  CHECK(time_left(7, 5, 100).empty());
}

TEST_CASE("the time left is bounded whatever the numbers are") {
  constexpr std::uint64_t kMost = ~std::uint64_t{0};
  CHECK(time_left(kMost / 50, kMost, 1e300) == "over 99 h left");
  CHECK(time_left(kMost - 1, kMost, 2).empty() == false);
  CHECK(time_left(1, 100, 99.0 * 3600 / 99) == "about 99 h left");
  CHECK(time_left(1, 100, 99.0 * 3600 / 99 + 1) == "over 99 h left");
}

TEST_CASE("the time left never grows while work goes on at one speed") {
  const auto seconds_of = [](const std::string& text) {
    const double count = std::atof(text.c_str() + std::string("about ").size());
    return count * (text.find(" h ") != std::string::npos ? 3600 : text.find(" min ") != std::string::npos ? 60 : 1);
  };
  for (const double seconds_each : {0.05, 1.0, 70.0}) {
    double last = 1e9;
    for (std::uint64_t done = 1; done < 1000; ++done) {
      const std::string text = time_left(done, 1000, seconds_each * static_cast<double>(done));
      if (text.empty()) continue;
      CHECK(seconds_of(text) <= last);
      CHECK(seconds_of(text) >= seconds_each * static_cast<double>(1000 - done) - 1e-6);
      last = seconds_of(text);
    }
  }
}

TEST_CASE("no text of a CSV file is a formula, and numbers stay numbers") {
  for (const char* const text :
       {"=1+2", "+x", "-x", "@x", "\tx", "'=x", "-2+3", "-.5", "+-1", "-1e", "-inf", "+", "-1 "})
    CHECK(perf::csv_field(text) == std::string("'") + text);
  CHECK(perf::csv_field("\nx") == "\"'\nx\"");
  for (const char* const text : {"-1", "+3", "-1.5e-3", "-1.", "+2E+9", "-1e999"}) CHECK(perf::csv_field(text) == text);
  CHECK(perf::csv_field("=A1,\"x\"") == "\"'=A1,\"\"x\"\"\"");
  for (const char* const text : {"", "hips", "a-b", "left=right"}) CHECK(perf::csv_field(text) == text);
  CHECK(perf::csv_field("a,b") == "\"a,b\"");
  const TemporaryFolder folder;
  const std::string path = folder / "rows.csv";
  perf::OutputFile file(path);
  perf::write_csv(file, {{{"name", "-link"}, {"depth", -0.5}, {"none", nullptr}, {"count", 3}}});
  CHECK(read_text(path) == "name,depth,none,count\n'-link,-0.5,,3\n");
}

TEST_CASE("a terminal shows how far a run is before a long step, and nothing of it at the end") {
  const int terminal = posix_openpt(O_RDWR | O_NOCTTY), before = dup(STDERR_FILENO);
  REQUIRE(terminal >= 0);
  REQUIRE(grantpt(terminal) == 0);
  REQUIRE(unlockpt(terminal) == 0);
  const int shown = open(ptsname(terminal), O_RDWR | O_NOCTTY);
  REQUIRE(shown >= 0);
  const auto read_all = [terminal](std::string expected) {
    std::string text;
    while (text.size() < expected.size()) {
      char bytes[256];
      pollfd ready = {terminal, POLLIN, 0};
      if (poll(&ready, 1, 10000) <= 0) break;
      const ssize_t size = read(terminal, bytes, sizeof bytes);
      if (size <= 0) break;
      text.append(bytes, static_cast<std::size_t>(size));
    }
    return text;
  };
  const std::string clear = "\r\033[K", line = clear + "files [..............................] 0 %";
  dup2(shown, STDERR_FILENO);
  std::string text, end;
  {
    perf::ProgressBar bar("files", 2);
    bar.begin_long_step();
    text = read_all(line);
  }
  end = read_all(clear);
  dup2(before, STDERR_FILENO);
  CHECK(text == line);
  CHECK(end == clear);
  for (const int file : {terminal, before, shown}) close(file);
}

TEST_CASE("a table prints no character that a terminal obeys") {
  perf::TextTable table;
  table.add_row({"a\x1b[31m", "b\nc\xc2\x9b"});
  std::ostringstream out;
  table.print(out);
  CHECK(out.str() == "a?[31m  b?c?\n");
}

}  // namespace
}  // namespace cab::tests
