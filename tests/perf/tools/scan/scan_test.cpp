// `cab scan` from outside: how the command becomes Python.
#include <doctest/doctest.h>

#include <cstdlib>
#include <filesystem>
#include <string>

#include "perf/tools/scan/package.h"
#include "scenes/import/printable.h"
#include "tests/perf/cli/spawn.h"

namespace cab::tests {
namespace {

using Paths = std::vector<std::filesystem::path>;

// A variable of the environment, for as long as this lives.
class Variable {
 public:
  Variable(std::string name, const std::string& value) : name_(std::move(name)) {
    setenv(name_.c_str(), value.c_str(), 1);
  }
  ~Variable() { unsetenv(name_.c_str()); }
  Variable(const Variable&) = delete;
  Variable& operator=(const Variable&) = delete;

 private:
  std::string name_;
};

TEST_CASE("cab scan finds its package beside an installed command and in a build tree") {
  const TemporaryFolder folder;
  const std::filesystem::path root = folder / "";
  const auto make = [&](const std::string& name) {
    std::filesystem::create_directories(root / name);
    write_text((root / name / "__init__.py").string(), "");
  };
  make("usr/share/cab/scan/cab_scan");
  make("build/perf/scan/cab_scan");
  CHECK(perf::find_scan_package(root / "usr/bin/cab") == Paths{root / "usr/share/cab/scan"});
  CHECK(perf::find_scan_package(root / "build/perf/cab") == Paths{root / "build/perf/scan"});
  make("build/engine/bindings/python/cab");
  CHECK(perf::find_scan_package(root / "build/perf/cab") ==
        Paths{root / "build/perf/scan", root / "build/engine/bindings/python"});
  CHECK(perf::find_scan_package(root / "other/cab").empty());
}

TEST_CASE("cab scan finds the Python module that was installed with its command") {
  const TemporaryFolder folder;
  const std::filesystem::path root = folder / "";
  CHECK(perf::find_installed_module(root / "usr/bin/cab").empty());
  const std::filesystem::path modules = root / "usr" / CAB_PYTHON_DIR;
  std::filesystem::create_directories(modules / "cab");
  write_text((modules / "cab/__init__.py").string(), "");
  CHECK(perf::find_installed_module(root / "usr/bin/cab") == modules);
}

TEST_CASE("empty parts of PYTHONPATH, which mean the current folder, are left out") {
  const TemporaryFolder folder;
  const std::string python = folder / "python";
  write_text(python, "#!/bin/sh\necho \"$PYTHONPATH\"\n");
  std::filesystem::permissions(python, std::filesystem::perms::owner_all);
  const Variable chosen("CAB_PYTHON", python), path("PYTHONPATH", ":/one::/two:");
  const std::string out = run_command("scan", {"self"}).out;
  CHECK(out.find("::") == std::string::npos);
  CHECK(out.rfind(":/one:/two\n") == out.size() - std::string(":/one:/two\n").size());
}

TEST_CASE("cab scan hands all words to Python, which the environment may choose") {
  const TemporaryFolder folder;
  const std::string python = folder / "python";
  write_text(python,
             "#!/bin/sh\nprintf '<%s>' \"$@\"; echo; echo \"$PYTHONPATH\"; echo \"$CAB_COMMAND\"; "
             "echo \"safe $PYTHONSAFEPATH\"; exit 7\n");
  std::filesystem::permissions(python, std::filesystem::perms::owner_all);
  const Variable chosen("CAB_PYTHON", python);
  const Outcome outcome = run_command("scan", {"self", "--help", "-h", "a b", "--units", "2"});
  CHECK(outcome.exit_code == 7);
  CHECK(outcome.out.rfind("<-c><import sys; ", 0) == 0);
  CHECK(outcome.out.find("><self><--help><-h><a b><--units><2>\n") != std::string::npos);
  CHECK(outcome.out.find("safe 1\n") != std::string::npos);
  CHECK(outcome.out.find("perf/scan") != std::string::npos);
  CHECK(outcome.out.find(CAB_COMMAND "\n") != std::string::npos);
}

TEST_CASE("the command and cab scan hide the same characters") {
  std::string hidden;
  for (unsigned c = 0; c < 0x110000; ++c) {
    if (c == '?' || (c >= 0xd800 && c < 0xe000)) continue;  // halves of surrogate pairs are no UTF-8
    std::string text(1, static_cast<char>(c));
    const auto low = [c](unsigned shift) { return static_cast<char>(0x80 | (c >> shift & 0x3f)); };
    if (c >= 0x10000)
      text = {static_cast<char>(0xf0 | c >> 18), low(12), low(6), low(0)};
    else if (c >= 0x800)
      text = {static_cast<char>(0xe0 | c >> 12), low(6), low(0)};
    else if (c >= 0x80)
      text = {static_cast<char>(0xc0 | c >> 6), low(0)};
    if (scenes::printable(text) == "?") hidden += std::to_string(c) + '\n';
  }
  const Paths packages = perf::find_scan_package(CAB_COMMAND);
  REQUIRE(!packages.empty());
  const std::string program =
      "import sys; sys.path.insert(0, sys.argv[1]); from cab_scan.printable import printable\n"
      "for c in range(0x110000):\n"
      "    if c not in range(0xD800, 0xE000) and c != ord('?') and printable(chr(c)) == '?':\n"
      "        print(c)\n";
  const Outcome outcome = spawn(CAB_PYTHON3, {"-B", "-c", program, packages.front().string()});
  CHECK(outcome.error.empty());
  CHECK(outcome.out == hidden);
  CHECK(hidden.size() > 4000 * 4);
}

TEST_CASE("cab scan says what is missing") {
  const TemporaryFolder folder;
  {
    const Variable chosen("CAB_PYTHON", folder / "nowhere");
    const Outcome outcome = run_command("scan", {"self", "x"});
    CHECK(outcome.exit_code == 1);
    CHECK(outcome.error.find("CAB_PYTHON") != std::string::npos);
  }
  {
    // Isolated from its packages, Python has neither NumPy nor cab.
    const std::string python = folder / "python";
    write_text(python, std::string("#!/bin/sh\nPYTHONPATH=${PYTHONPATH%%:*} exec ") + CAB_PYTHON3 + " -S \"$@\"\n");
    std::filesystem::permissions(python, std::filesystem::perms::owner_all);
    const Variable chosen("CAB_PYTHON", python);
    const Outcome outcome = run_command("scan", {"self", "x"});
    INFO(outcome.error);
    CHECK(outcome.exit_code == 1);
    CHECK(outcome.error.find("no module numpy (Debian: python3-numpy)") != std::string::npos);
    CHECK(outcome.error.find("no module cab (") != std::string::npos);
  }
  const std::string command = folder / "cab";  // it stands beside no package
  std::filesystem::copy_file(CAB_COMMAND, command);
  const Outcome outcome = spawn(command, {"scan", "self", "x"});
  CHECK(outcome.exit_code == 1);
  CHECK(outcome.error.find("cab_scan is not beside this command") != std::string::npos);
}

}  // namespace
}  // namespace cab::tests
