// `cab view` from outside.
#include <doctest/doctest.h>

#include <cstdint>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "tests/perf/cli/made_motion.h"
#include "tests/perf/cli/spawn.h"
#include "tests/scenes/import/made_skin.h"

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

// Files of a folder, by name.
std::set<std::string> names_in(const TemporaryFolder& folder) {
  std::set<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder / "."))
    names.insert(entry.path().filename().string());
  return names;
}

// The bytes of the first recording in a page.
std::string recording_in(const std::string& page) {
  const std::string begin = "class=\"cab-recording\" data-name=\"";
  const std::size_t mark = page.find(begin), first = page.find('>', mark) + 1;
  REQUIRE(mark != std::string::npos);
  std::string bytes;
  std::uint32_t bits = 0, count = 0;
  for (std::size_t i = first; page[i] != '<' && page[i] != '='; ++i) {
    const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    bits = bits << 6 | static_cast<std::uint32_t>(digits.find(page[i]));
    count += 6;
    if (count < 8) continue;
    count -= 8;
    bytes += static_cast<char>(bits >> count & 255);
  }
  return bytes;
}

TEST_CASE("cab view of motion files says what touches, and the page has the recording of cab run") {
  const TemporaryFolder folder;
  const std::string anna = folder / "anna.bvh", ben = folder / "ben.bvh", viewer = folder / "cab_view.html",
                    recording = folder / "run.cab", copy = folder / "copy.cab";
  write_text(viewer, "<!doctype html>\n<!--CAB-DATA-->\n<script>1</script>\n");
  write_text(anna, bvh_text({40, 0, 0, 0}));
  write_text(ben, bvh_text({40, 7, 0.5, 0.004}));
  const Outcome run = run_command("run", {anna, ben, "--self", "--record", recording});
  REQUIRE(run.exit_code == 0);
  std::set<std::string> expected = names_in(folder);
  const Outcome outcome = run_command("view", {anna, ben, "--self", "--page", viewer, "--frame", "39"});
  INFO(outcome.error);
  REQUIRE(outcome.exit_code == 0);
  expected.insert("anna.html");
  CHECK(names_in(folder) == expected);
  CHECK(outcome.error == run.error);
  const std::size_t answer = run.out.find("recording: ");
  CHECK(outcome.out.substr(0, answer) == run.out.substr(0, answer));
  CHECK(outcome.out.find("anna.html#recording=0&frame=39\n") != std::string::npos);
  const std::string page = read_text(folder / "anna.html");
  CHECK(page.find("data-name=\"anna.cab\"") != std::string::npos);
  write_text(copy, recording_in(page));
  const auto hash = [&](const std::string& file) {
    const std::string json = folder / "replayed.json";
    REQUIRE(run_command("replay", {file, "--json", json}).exit_code == 0);
    const std::string text = read_text(json), key = "\"hash\": \"";
    return text.substr(text.find(key) + key.size(), 16);
  };
  CHECK(hash(copy).find_first_not_of("0123456789abcdef") == std::string::npos);
  CHECK(hash(copy) == hash(recording));
}

TEST_CASE("cab view of surfaces tests their triangles, as cab run does") {
  const TemporaryFolder folder;
  const std::string boxes = folder / "boxes.glb", viewer = folder / "cab_view.html";
  write_text(boxes, glb(two_boxes()));
  write_text(viewer, "<!--CAB-DATA-->\n");
  const Words files = {boxes, boxes, "--offset", "0,0,0", "--offset", "0.5,0,0", "--body", "surface"};
  const Outcome run = run_command("run", files);
  REQUIRE(run.exit_code == 0);
  CHECK(run.out.find(" by their surfaces in ") != std::string::npos);
  Words words = files;
  words.insert(words.end(), {"--page", viewer});
  const Outcome outcome = run_command("view", words);
  INFO(outcome.error);
  REQUIRE(outcome.exit_code == 0);
  CHECK(outcome.out.rfind(run.out, 0) == 0);
  write_text(folder / "copy.cab", recording_in(read_text(folder / "boxes.html")));
  CHECK(run_command("replay", {folder / "copy.cab"}).exit_code == 0);
}

TEST_CASE("the recording of a page comes between no other files") {
  const TemporaryFolder folder;
  const std::string anna = folder / "anna.bvh", viewer = folder / "cab_view.html", page = folder / "page.cab";
  write_text(anna, bvh_text({5, 0, 0, 0}));
  write_text(viewer, "<!doctype html>\n<!--CAB-DATA-->\n");
  std::filesystem::create_directory(folder / "anna.cab");
  std::set<std::string> expected = names_in(folder);
  const auto view = [&](const Words& more) {
    Words words = {anna, anna, "--page", viewer};
    words.insert(words.end(), more.begin(), more.end());
    const Outcome outcome = run_command("view", words);
    INFO(outcome.error);
    CHECK(outcome.exit_code == 0);
  };
  view({});
  expected.insert("anna.html");
  CHECK(names_in(folder) == expected);
  view({"--out", page});
  expected.insert("page.cab");
  CHECK(names_in(folder) == expected);
  for (const std::string& written : {folder / "anna.html", page}) {
    const std::string text = read_text(written);
    CHECK(text.rfind("<!doctype html>", 0) == 0);
    CHECK(recording_in(text).rfind("CABREC", 0) == 0);
  }
}

TEST_CASE("a page that goes to standard output is alone there") {
  const TemporaryFolder folder;
  const std::string anna = folder / "anna.bvh", viewer = folder / "cab_view.html";
  write_text(anna, bvh_text({5, 0, 0, 0}));
  write_text(viewer, "<!doctype html>\n<!--CAB-DATA-->\n</html>\n");
  const std::string answer = run_command("run", {anna, anna}).out;
  REQUIRE(answer.find(" pairs of links touch ") != std::string::npos);
  const Words words = {anna, anna, "--page", viewer, "--out", "/dev/stdout"};
  Words piped = {"-c", "set -o pipefail; \"$@\" | cat", "bash", CAB_COMMAND, "view"};
  piped.insert(piped.end(), words.begin(), words.end());
  for (const Outcome& outcome : {spawn("/bin/bash", piped), run_command("view", words)}) {
    INFO(outcome.error);
    CHECK(outcome.exit_code == 0);
    CHECK(outcome.error.find(answer) != std::string::npos);
    const std::string begin = "<!doctype html>\n", end = "</html>\n";
    REQUIRE(outcome.out.size() > begin.size() + end.size());
    CHECK(outcome.out.substr(0, begin.size()) == begin);
    CHECK(outcome.out.substr(outcome.out.size() - end.size()) == end);
    CHECK(recording_in(outcome.out).rfind("CABREC", 0) == 0);
  }
}

TEST_CASE("cab view of a robot shows the states of a file") {
  const TemporaryFolder folder;
  const std::string robot = folder / "arm.urdf", states = folder / "states.csv", viewer = folder / "cab_view.html",
                    copy = folder / "copy.cab";
  write_text(viewer, "<!--CAB-DATA-->\n");
  const std::string body =
      "<collision><geometry><box size='0.2 0.2 1'/></geometry><origin xyz='0 0 0.5'/></collision></link>";
  write_text(robot, "<robot name='arm'><link name='a'>" + body + "<link name='b'>" + body + "<link name='c'>" + body +
                        "<joint name='one' type='continuous'><parent link='a'/><child link='b'/>"
                        "<origin xyz='0 0 1.1'/><axis xyz='1 0 0'/></joint>"
                        "<joint name='two' type='continuous'><parent link='b'/><child link='c'/>"
                        "<origin xyz='0 0 1.1'/><axis xyz='1 0 0'/></joint></robot>");
  write_text(states, "one,two\n0,0\n2,2\n0.5,3\n");
  const Outcome outcome = run_command("view", {robot, "--states", states, "--page", viewer});
  INFO(outcome.error);
  REQUIRE(outcome.exit_code == 0);
  CHECK(outcome.out.find("arm.html#recording=0&frame=0\n") != std::string::npos);
  write_text(copy, recording_in(read_text(folder / "arm.html")));
  const Outcome replayed = run_command("replay", {copy, "--isa", "scalar"});
  INFO(replayed.out);
  CHECK(replayed.exit_code == 0);
  CHECK(names_in(folder) == std::set<std::string>{"arm.urdf", "arm.html", "cab_view.html", "copy.cab", "states.csv"});
}

TEST_CASE("files and options that do not go into one page are refused") {
  const Recorded files;
  const std::string anna = files.folder / "anna.bvh", robot = files.folder / "arm.urdf";
  write_text(anna, bvh_text({5, 0, 0, 0}));
  write_text(robot, "<robot name='arm'/>");
  const auto refused = [&](Words words, const std::string& told) {
    words.insert(words.end(), {"--page", files.viewer});
    const Outcome outcome = run_command("view", words);
    INFO(outcome.error);
    CHECK(outcome.exit_code == 2);
    CHECK(outcome.error.find(told) != std::string::npos);
  };
  refused({files.recording, anna}, "or one robot make a page, not " + anna + " beside " + files.recording);
  refused({robot, robot}, "or one robot make a page");
  refused({files.recording, "--units", "1"}, "--units: it is about motion files");
  refused({robot, "--self"}, "--self: it is about motion files");
  refused({anna, "--states", robot}, "--states: it is about a robot");
  refused({anna, anna, "--frame", "5"}, "has 5 frames, counted from 0, not 5");
  CHECK_FALSE(std::filesystem::exists(files.folder / "anna.html"));
}

TEST_CASE("what cab view cannot do is told") {
  const Recorded files;
  const std::string other = files.folder / "other.cab";
  write_text(other, "no recording");
  const auto refuses = [](const std::string& command, const Words& words, const std::string& told) {
    const Outcome outcome = spawn(command, words);
    INFO(outcome.error);
    CHECK(outcome.exit_code == 1);
    CHECK(outcome.error.find(told) != std::string::npos);
  };
  refuses(CAB_COMMAND, {"view", other, "--page", files.viewer, "--out", files.page}, "it is not a recording");
  refuses(CAB_COMMAND, {"view", files.recording, "--page", files.recording}, "is no page of the viewer");
  CHECK_FALSE(std::filesystem::exists(files.page));
  const Outcome beyond = run_command("view", {files.recording, "--page", files.viewer, "--frame", "3"});
  CHECK(beyond.exit_code == 2);
  CHECK(beyond.error.find("has 3 frames, counted from 0, not 3") != std::string::npos);
  CHECK_FALSE(std::filesystem::exists(files.page));
  const std::string large = files.folder / "large.cab";  // a hole, which takes no room on the disk, ends it
  std::filesystem::copy_file(files.recording, large);
  std::filesystem::resize_file(large, 400000001);
  refuses(CAB_COMMAND, {"view", large, "--page", files.viewer, "--out", files.page},
          large + " has 400000001 bytes, and a page holds recordings of at most 400000000; ");
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
