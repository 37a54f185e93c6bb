// Files that the `cab` command writes: opened before the work, complete or not there.
#include <doctest/doctest.h>

#include <chrono>
#include <csignal>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "perf/base/output_file.h"
#include "perf/base/signals.h"
#include "tests/perf/cli/made_motion.h"
#include "tests/perf/cli/spawn.h"

namespace cab::tests {
namespace {

using Words = std::vector<std::string>;

// A figure, and a file that was there before.
struct Workplace {
  TemporaryFolder folder;
  std::string figure = folder / "anna.bvh", old_file = folder / "old.txt";
  Workplace() {
    write_text(figure, bvh_text({5, 0, 0, 0}));
    write_text(old_file, "old\n");
  }
  std::size_t file_count() const {
    std::size_t count = 0;
    for (const auto& entry : std::filesystem::directory_iterator(folder / ".")) count += entry.exists() ? 1 : 0;
    return count;
  }
};

}  // namespace

TEST_CASE("an output that cannot be written is refused before the work, with the system's reason") {
  const Workplace place;
  const std::string nowhere = place.folder / "no/such/file";
  const std::vector<Words> commands = {
      {"run", place.figure, "--self"}, {"inspect", place.figure},
      {"paper", "--tables", "1"},      {"crowd", "--scene", "uniform", "--characters", "100"},
      {"peers", "--characters", "10"}, {"sweep", place.figure},
      {"verify", "--rounds", "1"}};
  for (const Words& command : commands)
    for (const char* option : {"--json", "--csv", "--hits"}) {
      const std::string help = run_command(command.front(), {"--help"}).out;
      if (help.find(std::string(option) + " ") == std::string::npos) continue;
      Words words = command;
      words.insert(words.end(), {option, nowhere});
      CAPTURE(command.front());
      CAPTURE(option);
      const Outcome outcome = spawn(CAB_COMMAND, words);
      CHECK(outcome.exit_code == 1);
      CHECK(outcome.out.empty());
      CHECK(outcome.error == "cab: cannot write " + nowhere + ": No such file or directory\n");
    }
  const Outcome full = spawn(CAB_COMMAND, {"run", place.figure, "--self", "--json", "/dev/full"});
  CHECK(full.exit_code == 1);
  CHECK(full.error.find("cab: cannot write all of /dev/full: No space left on device\n") != std::string::npos);
  const Outcome folder = spawn(CAB_COMMAND, {"run", place.figure, "--self", "--hits", place.folder / "."});
  CHECK(folder.exit_code == 1);
  CHECK(folder.error.find(": Is a directory\n") != std::string::npos);
}

TEST_CASE("an older file stays until the new one is complete, and nothing else is left") {
  const Workplace place;
  const std::size_t files = place.file_count();
  const Words bad = {"run", place.folder / "missing.bvh", "--json", place.old_file, "--hits", place.folder / "new.csv"};
  CHECK(spawn(CAB_COMMAND, bad).exit_code == 1);
  CHECK(read_text(place.old_file) == "old\n");
  CHECK(place.file_count() == files);

  std::filesystem::permissions(place.old_file, std::filesystem::perms(0640));
  CHECK(spawn(CAB_COMMAND, {"run", place.figure, "--self", "--json", place.old_file}).exit_code == 0);
  CHECK(nlohmann::json::parse(read_text(place.old_file))["frame_count"] == 5);
  CHECK(std::filesystem::status(place.old_file).permissions() == std::filesystem::perms(0640));
  CHECK(place.file_count() == files);

  // A link stays a link.
  std::filesystem::create_symlink(place.old_file, place.folder / "link");
  CHECK(spawn(CAB_COMMAND, {"run", place.figure, "--self", "--hits", place.folder / "link"}).exit_code == 0);
  CHECK(std::filesystem::is_symlink(place.folder / "link"));
  CHECK(read_text(place.old_file).rfind("frame,character_a", 0) == 0);

  // So does one that leads to nothing yet.
  std::filesystem::create_symlink("later.csv", place.folder / "early");
  CHECK(spawn(CAB_COMMAND, {"run", place.figure, "--self", "--hits", place.folder / "early"}).exit_code == 0);
  CHECK(std::filesystem::is_symlink(place.folder / "early"));
  CHECK(read_text(place.folder / "later.csv").rfind("frame,character_a", 0) == 0);
}

TEST_CASE("one file under two names is no two outputs, and no input and output") {
  const Workplace place;
  namespace fs = std::filesystem;
  const std::string a = place.folder / "a.csv", dotted = place.folder / "./a.csv", around = place.folder / "x/../a.csv";
  fs::create_directory(place.folder / "x");
  fs::create_directory_symlink(".", place.folder / "same");
  fs::create_symlink("a.csv", place.folder / "link");  // to a file that is not there yet
  fs::create_symlink(place.figure, place.folder / "figure");
  fs::create_hard_link(place.figure, place.folder / "twin.bvh");
  fs::create_hard_link(place.old_file, place.folder / "old_twin");
  const std::size_t files = place.file_count();
  const auto refuses = [&](const Words& words, const std::string& told) {
    CAPTURE(words.back());
    const Outcome outcome = spawn(CAB_COMMAND, words);
    CHECK(outcome.exit_code == 2);
    CHECK(outcome.error.find(told) != std::string::npos);
    CHECK(place.file_count() == files);
  };
  for (const std::string& other : {a, dotted, around, place.folder / "same/a.csv", place.folder / "link"})
    refuses({"run", place.figure, "--self", "--hits", a, "--json", other}, "name the same file; give two");
  refuses({"run", place.figure, "--self", "--hits", place.old_file, "--json", place.folder / "old_twin"},
          "name the same file; give two");
  for (const std::string& input : {place.figure, place.folder / "./anna.bvh", place.folder / "same/anna.bvh",
                                   place.folder / "figure", place.folder / "twin.bvh"})
    refuses({"run", place.figure, "--self", "--hits", input}, "is an input; write the output to another file");
  refuses({"report", place.figure, "--csv", a, "--pairs", dotted}, "name the same file; give two");
  refuses({"view", a, "--page", place.old_file, "--out", place.folder / "old_twin"}, "is an input");
  refuses({"run", place.figure, "--self", "--bodies", place.old_file, "--json", place.old_file}, "is an input");
  refuses({"verify", "--rounds", "1", "--resume", a, "--json", dotted}, "name the same file; give two");
  // Devices take what is written under each of their names.
  CHECK(spawn(CAB_COMMAND, {"run", place.figure, "--self", "--hits", "/dev/null", "--json", "/dev/./null"}).exit_code ==
        0);
}

TEST_CASE("a signal leaves the older file and removes the new one") {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGPIPE, SIGXCPU}) {
    CAPTURE(signal);
    const Workplace place;
    const std::size_t files = place.file_count();
    const pid_t child =
        start(CAB_COMMAND, {"verify", "--minutes", "60", "--json", place.old_file}, "/dev/null", "/dev/null");
    for (int wait = 0; wait < 60000 && place.file_count() == files; ++wait)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    kill(child, signal);
    CHECK(exit_code_of(child) == 128 + signal);
    CHECK(read_text(place.old_file) == "old\n");
    CHECK(place.file_count() == files);
  }
}

TEST_CASE("a signal removes every new file, however many there are and whichever were kept") {
  const Workplace place;
  const std::size_t files = place.file_count();
  const pid_t child = fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    perf::clean_up_at_signals();
    std::vector<std::unique_ptr<perf::FileAside>> aside;
    for (int round = 0; round < 2; ++round) {  // the second takes the places of files that are gone
      aside.clear();
      for (int n = 0; n < 40; ++n)
        aside.push_back(std::make_unique<perf::FileAside>(place.folder / ("new" + std::to_string(n))));
      aside[3]->keep();
      aside[30]->keep();
    }
    const perf::TemporaryFile temporary(place.folder / ".");
    std::raise(SIGTERM);
    _exit(0);
  }
  CHECK(exit_code_of(child) == 128 + SIGTERM);
  CHECK(place.file_count() == files + 2);
}

TEST_CASE("files of one folder for what only the command reads have names of their own, and go with their objects") {
  const Workplace place;
  const std::size_t files = place.file_count();
  {
    const perf::TemporaryFile first(place.folder / "."), second(place.folder / ".");
    CHECK(first.path() != second.path());
    CHECK(place.file_count() == files + 2);
    CHECK(read_text(first.path()).empty());
  }
  CHECK(place.file_count() == files);
  CHECK_THROWS_WITH(perf::TemporaryFile(place.folder / "none"), doctest::Contains(": No such file or directory"));
}

TEST_CASE("a command whose reader goes away leaves no file") {
  const Workplace place;
  const std::size_t files = place.file_count();
  const std::string line = "\"$@\" 2>/dev/null | true; echo ${PIPESTATUS[0]}";
  const Outcome outcome =
      spawn("/bin/bash", {"-c", line, "bash", CAB_COMMAND, "crowd", "--scene", "uniform", "--characters", "100",
                          "--frames", "1", "--rounds", "1", "--json", place.old_file});
  CHECK(outcome.exit_code == 0);
  CHECK(place.file_count() == files);
}

TEST_CASE("a limit on the size of files is told as a full disk is, by every command, and no file is left") {
  const Workplace place;
  const std::string record = place.folder / "take.cab", out = place.folder / "out";
  REQUIRE(run_command("record", {"--scene", "hand", "--frames", "0:30", "--out", record}).exit_code == 0);
  write_text(place.folder / "cab_view.html", "<!doctype html>\n<!--CAB-DATA-->\n<script>1</script>\n");
  const std::size_t files = place.file_count();
  const std::vector<Words> commands = {
      {"run", place.figure, "--self", "--json", out},
      {"inspect", place.figure, "--json", out},
      {"crowd", "--scene", "uniform", "--characters", "100", "--frames", "1", "--rounds", "1", "--json", out},
      {"view", record, "--page", place.folder / "cab_view.html", "--out", out},
      {"peers", "--scene", "jitter", "--characters", "10", "--rounds", "1", "--json", out},
      {"paper", "--tables", "1", "--frames", "10", "--json", out}};
  const std::string script = "ulimit -f 1; exec \"$@\"", error = place.folder / "error";
  for (const Words& command : commands) {
    CAPTURE(command.front());
    Words words = {"-c", script, "bash", CAB_COMMAND};
    words.insert(words.end(), command.begin(), command.end());
    CHECK(exit_code_of(start("/bin/bash", words, "/dev/null", error)) == 1);
    CHECK(read_text(error).find(": File too large\n") != std::string::npos);
    std::filesystem::remove(error);
    CHECK(place.file_count() == files);
  }
  // A recording is written where it stays.
  const Words words = {"-c",   script,     "bash", CAB_COMMAND, "record", "--scene",
                       "hand", "--frames", "0:30", "--out",     out};
  CHECK(exit_code_of(start("/bin/bash", words, "/dev/null", error)) == 1);
  CHECK(read_text(error).find(": File too large\n") != std::string::npos);
}

}  // namespace cab::tests
