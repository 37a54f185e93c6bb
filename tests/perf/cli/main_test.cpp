// The `cab` command and slips of the pen, and what it shows on a terminal.
#include <doctest/doctest.h>
#include <signal.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/perf/cli/made_motion.h"
#include "tests/perf/cli/spawn.h"
#include "tests/sanitizers.h"

namespace cab::tests {
namespace {

using Words = std::vector<std::string>;

struct Workplace {
  TemporaryFolder folder;
  std::string figure = folder / "anna.bvh";
  Workplace() { write_text(figure, bvh_text({5, 0, 0, 0})); }
};

// What the command prints to a terminal as its standard error. With a signal, it is sent once the command shows how far
// it is, and must end the command.
std::string run_at_terminal(const Words& arguments, int signal = 0) {
  const int terminal = posix_openpt(O_RDWR | O_NOCTTY);
  REQUIRE(terminal >= 0);
  REQUIRE(grantpt(terminal) == 0);
  REQUIRE(unlockpt(terminal) == 0);
  const std::string name = ptsname(terminal);
  const int kept_open = open(name.c_str(), O_RDWR | O_NOCTTY);
  REQUIRE(kept_open >= 0);
  const pid_t child = start(CAB_COMMAND, arguments, "/dev/null", name);
  std::string shown;
  const auto read_more = [&] {
    char bytes[1 << 16];
    const ssize_t size = read(terminal, bytes, sizeof bytes);
    REQUIRE(size >= 0);
    shown.append(bytes, static_cast<std::size_t>(size));
  };
  while (signal != 0 && shown.find('[') == std::string::npos) read_more();
  if (signal != 0) kill(child, signal);
  REQUIRE(exit_code_of(child) == (signal != 0 ? 128 + signal : 0));
  read_more();
  close(kept_open);
  close(terminal);
  return shown;
}

}  // namespace

TEST_CASE("empty names of files, unknown commands and options, and senseless policies are refused with advice") {
  const Workplace place;
  const std::string& file = place.figure;
  struct Misuse {
    Words arguments;
    std::string told;
  };
  const std::vector<Misuse> misuses = {
      {{"run", file, "--hits", ""}, "--hits: '' names no file"},
      {{"run", file, "--hits="}, "--hits"},
      {{"run", file, "--json", ""}, "--json: '' names no file"},
      {{"run", file, "--json", "-"}, "--json: '-' names no file; give /dev/stdout for standard output"},
      {{"verify", "--resume", "-"}, "--resume: '-' names no file"},
      {{"run", ""}, "FILE: '' names no file"},
      {{"inspect", ""}, "FILE: '' names no file"},
      {{"inspect", file, "--write-bodies", ""}, "--write-bodies: '' names no file"},
      {{"inspect", file, "--json", ""}, "--json: '' names no file"},
      {{"paper", "--csv", ""}, "--csv: '' names no file"},
      {{"verify", "--resume", ""}, "--resume: '' names no file"},
      {{"crowd", "--scene", "battle", "--clip", ""}, "--clip: '' names no file"},
      {{"crowd", "--scene", "bottleneck", "--clip", file, "--trajectories", ""}, "--trajectories: '' names no file"},
      {{"rnu", file}, "there is no command 'rnu'; did you mean run?"},
      {{"inspec", file}, "did you mean inspect?"},
      {{"sweeep"}, "did you mean sweep?"},
      {{"walk"}, "there is no command 'walk'; choose run, inspect"},
      {{"run", file, "--strateg", "tree"}, "did you mean --strategy?"},
      {{"run", file, "--treads=2"}, "did you mean --threads?"},
      {{"verify", "--minutes", "x"}, "--minutes: 'x' is not a number above 0, for example 0.5\n"},
      {{"run", file, "--units", "x"}, "--units: 'x' is not a number above 0, for example 0.0254 for inches\n"},
      {{"inspect", file, "--frame", "lost"}, "--frame: 'lost' is not a frame, counted from 0, or the word last"},
      {{"run", file, "--threads", "0x2"}, "--threads: '0x2' is not a whole number from 0 to 1024\n"},
      {{"run", file, "--threads", ""}, "--threads: '' is not a whole number from 0 to 1024\n"},
      {{"run", file, "--self", "--rest-frame", "4294967296"}, "whole number from 0 to 4294967295\n"},
      {{"run", file, "--body", "skin", "--leaves-per-link", "0x8"}, "'0x8' is not a whole number from 1 to 64\n"},
      {{"robot", file, "--leaves-per-link", "0x8"}, "'0x8' is not a whole number from 1 to 64\n"},
      {{"robot", file, "--margin", "nan"}, "--margin: 'nan' is not a number from 0 to 1e+06\n"},
      {{"crowd", "--scene", "uniform", "--coarse", "nan"}, "--coarse: 'nan' is not a number from 0 to 1\n"},
      {{"crowd", "--scene", "ropes", "--spacing", "nan"}, "--spacing: 'nan' is not a number from 0.1 to 10\n"},
      {{"crowd", "--scene", "ropes", "--links", "0x8"}, "--links: '0x8' is not a whole number from 2 to 1024\n"},
      {{"peers", "--surfaces", file, "--apart", "nan"}, "--apart: 'nan' is not a number from 0 to 1e+06\n"},
      {{"verify", "--round", "18446744073709551616"}, "--round: '18446744073709551616' is not a whole number from 0"},
      {{"verify", "--rounds", "-1"}, "--rounds: '-1' is not a whole number from 0 to 18446744073709551615\n"},
      {{"verify", "--rounds", "1", "--seed", "-1"}, "--seed: '-1' is not a whole number from 0"},
  };
  for (const Misuse& misuse : misuses) {
    CAPTURE(misuse.told);
    const Outcome outcome = spawn(CAB_COMMAND, misuse.arguments);
    CAPTURE(outcome.error);
    CHECK(outcome.exit_code == 2);
    CHECK(outcome.out.empty());
    CHECK(outcome.error.find(misuse.told) != std::string::npos);
  }
}

TEST_CASE("whole numbers are decimal, also with zeros before them") {
  const TemporaryFolder folder;
  const std::string path = folder / "out.json";
  const auto json = [&path](Words words) {
    words.insert(words.end(), {"--json", path});
    const Outcome outcome = spawn(CAB_COMMAND, words);
    INFO(outcome.error);
    REQUIRE(outcome.exit_code == 0);
    return nlohmann::json::parse(read_text(path));
  };
  const auto crowd = json({"crowd", "--scene", "uniform", "--characters", "0100", "--frames", "08", "--rounds", "01"});
  CHECK(crowd["characters"] == 100);
  CHECK(crowd["frames"] == 8);
  CHECK(json({"verify", "--part", "merges", "--rounds", "1", "--seed", "010"})["seed"] == 10);
}

TEST_CASE("standard output that cannot be written ends in one line with the system's reason") {
  const Workplace place;
  for (const Words& words : {Words{"--help"}, Words{"inspect", place.figure}, Words{"run", place.figure, "--self"}}) {
    CAPTURE(words.front());
    const std::string error = place.folder / "error";
    CHECK(exit_code_of(start(CAB_COMMAND, words, "/dev/full", error)) == 1);
    const std::string told = read_text(error);
    CHECK(told.find("cab: cannot write to standard output: No space left on device\n") != std::string::npos);
  }
}

TEST_CASE("inspect takes the last frame by its name") {
  const Workplace place;
  const std::string last = run_command("inspect", {place.figure, "--json", "--frame", "last"}).out;
  CHECK(last == run_command("inspect", {place.figure, "--json", "--frame", "4"}).out);
  CHECK(last == run_command("inspect", {place.figure, "--json", "-", "--frame", "4"}).out);
  CHECK(nlohmann::json::parse(last)["frame"] == 4);
}

TEST_CASE("an offset that is given for some of the files only is a note") {
  const Workplace place;
  const auto note_of = [&](Words offsets) {
    Words words = {"run", place.figure, place.figure};
    words.insert(words.end(), offsets.begin(), offsets.end());
    return spawn(CAB_COMMAND, words).error;
  };
  CHECK(note_of({"--offset", "1,0,0"}).find("note: --offset is given for 1 of 2 files: it moves anna.bvh only") !=
        std::string::npos);
  CHECK(note_of({}).find("--offset") == std::string::npos);
  CHECK(note_of({"--offset", "1,0,0", "--offset", "0,0,0"}).find("--offset") == std::string::npos);
}

TEST_CASE("a terminal shows the progress of a run until Ctrl-C clears its line, a file does not") {
  const Workplace place;
  CHECK(run_command("run", {place.figure, place.figure}).error.find('[') == std::string::npos);
  for (const int signal : {SIGINT, SIGTERM}) {
    const std::string shown = run_at_terminal({"record", "--scene", "uniform", "--characters", "100", "--frames",
                                               "0:1000000", "--out", place.folder / "r.cab"},
                                              signal);
    const std::string clear = "\r\033[K";
    CHECK(shown.rfind(clear) == shown.size() - clear.size());
  }
}

TEST_CASE("memory that runs out is told with the limit that it ran into") {
  if (kReservesAddressSpace) {
    MESSAGE("skipped: programs with ASan or TSan do not start under a limit on their address space");
    return;
  }
  const Outcome outcome = spawn("/bin/bash", {"-c", "ulimit -v 150000; exec \"$@\"", "bash", CAB_COMMAND, "crowd",
                                              "--scene", "uniform", "--characters", "1000000"});
  CHECK(outcome.exit_code == 1);
  CHECK(outcome.error.find("out of memory: the limit on address space (ulimit -v) is 146 MB\n") != std::string::npos);
}

}  // namespace cab::tests
