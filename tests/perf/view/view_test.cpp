// `cab view` from outside.
#include <doctest/doctest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "tests/perf/cli/spawn.h"

namespace cab::tests {
namespace {

using Words = std::vector<std::string>;

struct Recorded {
  TemporaryFolder folder;
  std::string recording = folder / "two hands.cab", viewer = folder / "cab_view.html", page = folder / "two hands.html";
  Recorded() {
    write_text(viewer, "<!doctype html>\n<!--CAB-DATA-->\n<script>1</script>\n");
    const Outcome outcome = run_command("record", {"--scene", "hand", "--frames", "0:3", "--out", recording});
    REQUIRE(outcome.exit_code == 0);
  }
};

TEST_CASE("cab view writes the recordings into the page, and says where a browser finds it") {
  const Recorded files;
  const Outcome outcome =
      run_command("view", {files.recording, files.recording, "--page", files.viewer, "--frame", "2"});
  INFO(outcome.error);
  REQUIRE(outcome.exit_code == 0);
  const std::string page = read_text(files.page);
  const std::string mark =
      "<script type=\"application/octet-stream\" class=\"cab-recording\" data-name=\"two hands.cab\">";
  const std::size_t first = page.find(mark), second = page.find(mark, first + 1);
  REQUIRE(second != std::string::npos);
  CHECK(page.find("Q0FCUkVDDQoBAAAA", first) == first + mark.size());  // CABREC, and version 1
  CHECK(page.find("<script>1</script>") > second);
  CHECK(outcome.out.find(std::to_string(page.size()) + " bytes") != std::string::npos);
  CHECK(outcome.out.find("two%20hands.html#recording=0&frame=2\n") != std::string::npos);
  CHECK(outcome.out.find("file:///") != std::string::npos);
}

TEST_CASE("what cab view cannot do is told") {
  const Recorded files;
  const auto refuses = [](const std::string& command, const Words& words, const std::string& told) {
    const Outcome outcome = spawn(command, words);
    INFO(outcome.error);
    CHECK(outcome.exit_code == 1);
    CHECK(outcome.error.find(told) != std::string::npos);
  };
  refuses(CAB_COMMAND, {"view", files.viewer, "--page", files.viewer, "--out", files.page}, "it is not a recording");
  refuses(CAB_COMMAND, {"view", files.recording, "--page", files.recording}, "is no page of the viewer");
  CHECK_FALSE(std::filesystem::exists(files.page));
  const Outcome beyond = run_command("view", {files.recording, "--page", files.viewer, "--frame", "3"});
  CHECK(beyond.exit_code == 2);
  CHECK(beyond.error.find("has 3 frames, counted from 0, not 3") != std::string::npos);
  CHECK_FALSE(std::filesystem::exists(files.page));
  const std::string command = files.folder / "cab";  // it stands beside no page
  std::filesystem::copy_file(CAB_COMMAND, command);
  refuses(command, {"view", files.recording}, "cab_view.html, is not beside this command");
  const std::string whole = read_text(files.recording), cut = files.folder / "cut.cab";
  write_text(cut, whole + "CHNK");
  const Outcome outcome = run_command("view", {cut, "--page", files.viewer});
  CHECK(outcome.exit_code == 0);
  CHECK(outcome.error.find("warning: " + cut + ": chunk 2 ") != std::string::npos);
}

}  // namespace
}  // namespace cab::tests
