// `cab record`, `cab replay` and `--record` of other commands, from outside.
#include <cab/cab.h>
#include <cab/replay.h>
#include <doctest/doctest.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "tests/engine/record/lost_frames.h"
#include "tests/perf/cli/made_motion.h"
#include "tests/perf/cli/spawn.h"

namespace cab::tests {
namespace {

using Json = nlohmann::json;
using Words = std::vector<std::string>;

// Two figures who meet, and what `cab run` says of them.
struct Dance {
  TemporaryFolder folder;
  std::string anna = folder / "anna.bvh", ben = folder / "ben.bvh", hits = folder / "hits.csv",
              recording = folder / "dance.cab", table = folder / "table.json";

  Dance() {
    write_text(anna, bvh_text({80, 0, 0, 0}));
    write_text(ben, bvh_text({80, 7, 0.5, 0.004}));
  }
  Outcome run(const Words& options) const {
    Words words = {anna, ben, "--offset", "0,0,0", "--offset", "0,0,0.1", "--hits", hits, "--record", recording};
    words.insert(words.end(), options.begin(), options.end());
    Outcome outcome = run_command("run", words);
    INFO(outcome.error);
    REQUIRE(outcome.exit_code == 0);
    return outcome;
  }
  Json replay(const Words& options, int exit_code = 0) const {
    Words words = {recording, "--json", table};
    words.insert(words.end(), options.begin(), options.end());
    const Outcome outcome = run_command("replay", words);
    INFO(outcome.error);
    INFO(outcome.out);
    CHECK(outcome.exit_code == exit_code);
    Json json = Json::parse(read_text(table));
    json["told"] = outcome.error;
    json["printed"] = outcome.out;
    return json;
  }
};

// frame, character, link, character, link of each line of --hits.
std::set<std::string> lines_of(const std::string& csv) {
  std::set<std::string> lines;
  std::istringstream stream(csv);
  std::string line;
  std::getline(stream, line);
  while (std::getline(stream, line)) {
    std::size_t end = 0;
    for (int fields = 0; fields < 5 && end != std::string::npos; ++fields) end = line.find(',', end + 1);
    lines.insert(line.substr(0, end));
  }
  return lines;
}

// The same of a recording.
std::set<std::string> lines_of(record::Recording& recording) {
  std::set<std::string> lines;
  for (std::uint32_t f = 0; f < recording.frame_count(); ++f) {
    record::RecordedFrame frame;
    REQUIRE(recording.read_frame(f, &frame));
    for (const Hit& hit : frame.hits) {
      const auto side = [&](BatchSlot slot, std::uint32_t link) {
        const record::RecordedBatch batch = recording.batch(slot.value - 1);
        return std::string(batch.name) + "," + recording.articulation(batch.articulation).link_names[link];
      };
      lines.insert(std::to_string(f) + "," + side(hit.batch_a, hit.link_a) + "," + side(hit.batch_b, hit.link_b));
    }
  }
  return lines;
}

TEST_CASE("a recording of cab run has the hits of its CSV file, with and without the links of each") {
  const Dance dance;
  for (const Words& options : {Words{}, Words{"--exact", "convex", "--self"}, Words{"--compress"},
                               Words{"--min-depth", "0.02"}, Words{"--strategy", "brute", "--threads", "2"}}) {
    dance.run(options);
    record::Recording recording;
    INFO(recording.error());
    REQUIRE(recording.open(dance.recording.c_str()));
    CHECK(recording.problems().empty());
    CHECK(recording.frame_count() == 80);
    CHECK(recording.info().seconds_per_frame == 0.04);
    CHECK(recording.info().metres_per_unit == 1);
    CHECK(recording.info().up == 'y');
    CHECK(std::string(recording.batch(1).name) == "ben.bvh");
    const std::set<std::string> expected = lines_of(read_text(dance.hits));
    CHECK(expected.size() > 50);
    CHECK(lines_of(recording) == expected);
  }
}

TEST_CASE("a recording replays to one hash on every instruction set, by threads and by policies of speed") {
  const Dance dance;
  dance.run({});
  const Json first = dance.replay({});
  CHECK(first["results"].size() == 1);
  CHECK(first["results"][0]["different_frames"] == 0);
  CHECK(first["results"][0]["frames"] == 80);
  const Json hash = first["results"][0]["hash"];
  std::string isas;
  for (std::uint8_t i = 1; i < kIsaCount; ++i)
    if (isa_available(static_cast<Isa>(i)))
      isas += (isas.empty() ? "" : ",") + std::string(to_string(static_cast<Isa>(i)));
  for (const Words& options : {Words{"--isa", isas}, Words{"--threads", "2"}, Words{"--strategy", "tree"},
                               Words{"--refit", "best3"}, Words{"--extents", "leaves", "--strategy", "brute"}}) {
    const Json json = dance.replay(options);
    for (const Json& result : json["results"]) {
      CHECK(result["hash"] == hash);
      CHECK(result["different_frames"] == 0);
    }
  }
}

TEST_CASE("the first frame and hit that differ are named") {
  const Dance dance;
  dance.run({});
  record::Recording recording;
  REQUIRE(recording.open(dance.recording.c_str()));
  record::RecordedFrame frame;
  std::uint32_t first = 0;
  do { REQUIRE(recording.read_frame(first++, &frame)); } while (frame.hits.empty());
  const Json json = dance.replay({"--exact", "none"}, 1);
  const Json& result = json["results"][0];
  CHECK(result["different_frames"] > 10);
  const std::string difference = result["first_difference"];
  CHECK(difference.rfind("frame " + std::to_string(first - 1) + ", hit 0 of ", 0) == 0);
  CHECK(difference.find("recorded is anna.bvh ") != std::string::npos);
  CHECK(difference.find("depth ") != std::string::npos);
  CHECK(json["printed"].get<std::string>().find(difference) != std::string::npos);
  CHECK(json["printed"].get<std::string>().find("no, in ") != std::string::npos);
}

TEST_CASE("of a recording that is cut off the whole part replays, and the exit code is 1") {
  const Dance dance;
  dance.run({});
  const std::string whole = read_text(dance.recording);
  // The two figures fill less than a chunk, so a second one is made by a recording of the paper behind it.
  const std::string cut = dance.folder / "cut.cab";
  Outcome outcome = run_command("record", {"--scene", "chains3", "--frames", "0:3000", "--out", cut});
  REQUIRE(outcome.exit_code == 0);
  const std::string chains = read_text(cut);
  write_text(cut, chains.substr(0, chains.size() - 100));
  outcome = run_command("replay", {cut});
  CHECK(outcome.exit_code == 1);
  CHECK(outcome.error.find("warning: " + cut + ": chunk ") != std::string::npos);
  CHECK(outcome.error.find("is cut off") != std::string::npos);
  CHECK(outcome.out.find("yes") != std::string::npos);
  write_text(cut, whole.substr(0, 1000));
  outcome = run_command("replay", {cut});
  CHECK(outcome.exit_code == 1);
  CHECK(outcome.error.find("it has no whole chunk") != std::string::npos);
}

TEST_CASE("millions of frames that a small file claims are counted as unread, and the rest replays") {
  const Dance dance;
  dance.run({});
  write_text(dance.recording, read_text(dance.recording) + claimed_gaps(80));
  const Json json = dance.replay({}, 1);
  CHECK(json["frame_count"] == 16777297);
  CHECK(json["results"][0]["frames"] == 80);
  CHECK(json["results"][0]["unread_frames"] == 16777217);
  CHECK(json["results"][0]["different_frames"] == 0);
}

TEST_CASE("a recording that was not closed is said to be so by every command that reads it") {
  const Dance dance;
  dance.run({});
  const std::string whole = read_text(dance.recording), cut = dance.folder / "cut.cab",
                    viewer = dance.folder / "cab_view.html";
  write_text(viewer, "<!--CAB-DATA-->\n");
  write_text(cut, whole.substr(0, whole.size() - 48));  // without the mark of the end
  const std::string told = "warning: " + cut +
                           ": it is not closed: its recorder ended before its end, or still writes; frames from 80 on "
                           "may be missing\n";
  Outcome outcome = run_command("replay", {cut});
  CHECK(outcome.exit_code == 1);
  CHECK(outcome.error == told);
  CHECK(outcome.out.find("yes") != std::string::npos);
  outcome = run_command("report", {cut, "--csv", dance.folder / "cut.csv"});
  CHECK(outcome.exit_code == 1);
  CHECK(outcome.error == told);
  CHECK(read_text(dance.folder / "cut.csv").find("it is not closed") != std::string::npos);
  outcome = run_command("view", {cut, "--page", viewer});
  CHECK(outcome.exit_code == 0);
  CHECK(outcome.error == told);
  CHECK(run_command("replay", {dance.recording}).error.empty());
}

TEST_CASE("a run that fails or is ended keeps the older recording, and one that is killed leaves the new one aside") {
  const TemporaryFolder folder;
  const std::string recording = folder / "r.cab", link = folder / "link.cab";
  const auto files = [&] {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder / "."))
      names.push_back(entry.path().filename().string());
    return names;
  };
  const Words small = {"record", "--scene", "uniform", "--characters", "10", "--frames", "0:3", "--out"};
  const auto with = [](Words words, const Words& more) {
    words.insert(words.end(), more.begin(), more.end());
    return words;
  };
  REQUIRE(spawn(CAB_COMMAND, with(small, {recording})).exit_code == 0);
  std::filesystem::permissions(recording, std::filesystem::perms(0640));
  const std::string old = read_text(recording);

  const Outcome failed = spawn(CAB_COMMAND, with(small, {recording, "--pose-step", "0.0000152587890625"}));
  CHECK(failed.exit_code == 1);
  INFO(failed.error);
  CHECK(failed.error.rfind("cab: " + recording + ": a pose is out of reach", 0) == 0);
  CHECK(read_text(recording) == old);
  CHECK(files().size() == 1);

  const Words large = {"record", "--scene", "uniform", "--characters", "2000", "--frames", "0:100000", "--out"};
  for (const int signal : {SIGINT, SIGTERM, SIGKILL}) {
    CAPTURE(signal);
    const pid_t child = start(CAB_COMMAND, with(large, {recording}), "/dev/null", "/dev/null");
    const std::string aside = recording + ".new-" + std::to_string(child);
    std::error_code none_yet;
    for (int wait = 0; wait < 60000; ++wait) {
      const std::uintmax_t size = std::filesystem::file_size(aside, none_yet);
      if (!none_yet && size > 6'000'000) break;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    kill(child, signal);
    CHECK(exit_code_of(child) == 128 + signal);
    CHECK(read_text(recording) == old);
    CHECK(files().size() == (signal == SIGKILL ? 2 : 1));
    if (signal != SIGKILL) continue;
    record::Recording partial;
    REQUIRE(partial.open(aside.c_str()));
    CHECK(partial.frame_count() > 0);
    CHECK_FALSE(partial.is_closed());
    CHECK_FALSE(partial.is_damaged());
    std::filesystem::remove(aside);
  }

  // A new recording has the rights of the older one, and a link stays a link.
  std::filesystem::create_symlink("r.cab", link);
  REQUIRE(spawn(CAB_COMMAND, with(small, {link, "--compress"})).exit_code == 0);
  CHECK(std::filesystem::is_symlink(link));
  CHECK(read_text(recording) != old);
  CHECK(std::filesystem::status(recording).permissions() == std::filesystem::perms(0640));
  const Outcome full = spawn(CAB_COMMAND, with(small, {"/dev/full"}));
  CHECK(full.exit_code == 1);
  CHECK(full.error == "cab: /dev/full: cannot write: No space left on device\n");
}

TEST_CASE("poses in 16 bits run as they are recorded, and the difference is told") {
  const Dance dance;
  const Outcome outcome = dance.run({"--pose-step", "0.015625"});
  CHECK(outcome.error.find("with poses rounded to 16 bits there are ") != std::string::npos);
  const Json json = dance.replay({});
  CHECK(json["results"][0]["different_frames"] == 0);
  Words words = {dance.anna, "--self", "--record", dance.recording, "--pose-step", "0.01"};
  Outcome refused = run_command("run", words);
  CHECK(refused.exit_code == 1);
  CHECK(refused.error.find("power of two") != std::string::npos);
  words.back() = "0.0000152587890625";
  refused = run_command("run", words);
  CHECK(refused.exit_code == 1);
  CHECK(refused.error.find("choose a larger --pose-step") != std::string::npos);
}

TEST_CASE("scenes that have a name are recorded") {
  const TemporaryFolder folder;
  const std::string file = folder / "scene.cab";
  struct Case {
    Words options;
    std::uint32_t frames, batches;
    char up;
  };
  const Case cases[] = {{{"--scene", "hand", "--frames", "100:120", "--exact", "convex"}, 20, 5, 0},
                        {{"--scene", "uniform", "--characters", "40"}, 30, 1, 'z'},
                        {{"--scene", "level", "--characters", "20", "--frames", "0:4"}, 4, 2, 'z'},
                        {{"--scene", "mixed", "--characters", "30", "--frames", "0:2", "--margin", "0.1"}, 2, 4, 'z'},
                        {{"--scene", "ropes-64", "--characters", "3", "--frames", "0:2", "--compress"}, 2, 1, 'z'},
                        {{"--scene", "spot-30", "--frames", "0:2", "--pose-step", "0.0009765625"}, 2, 1, 'z'}};
  for (const Case& entry : cases) {
    CAPTURE(entry.options[1]);
    Words words = entry.options;
    words.insert(words.end(), {"--out", file});
    const Outcome outcome = run_command("record", words);
    INFO(outcome.error);
    REQUIRE(outcome.exit_code == 0);
    record::Recording recording;
    REQUIRE(recording.open(file.c_str()));
    CHECK(recording.frame_count() == entry.frames);
    CHECK(recording.batch_count() == entry.batches);
    CHECK(recording.info().up == entry.up);
    CHECK(outcome.out == file + ": " + std::to_string(entry.frames) + " frames, " +
                             outcome.out.substr(outcome.out.find("frames, ") + 8));
    CHECK(outcome.out.find(std::to_string(std::filesystem::file_size(file)) + " bytes") != std::string::npos);
    CHECK(run_command("replay", {file, "--isa", "scalar"}).exit_code == 0);
  }
}

TEST_CASE("the states of a robot are recorded as they are checked") {
  const TemporaryFolder folder;
  const std::string robot = folder / "two.urdf", hits = folder / "hits.csv", file = folder / "two.cab";
  const std::string ball = "<collision><geometry><sphere radius='1'/></geometry></collision>";
  const std::string limit = "<limit lower='-6' upper='6' effort='1' velocity='1'/>";
  write_text(robot, "<robot name='two'><link name='base'>" + ball + "</link><link name='mid'>" + ball +
                        "</link><link name='end'>" + ball +
                        "</link><joint name='a' type='prismatic'><parent link='base'/><child link='mid'/>"
                        "<origin xyz='0 100 0'/><axis xyz='1 0 0'/>" +
                        limit +
                        "</joint><joint name='b' type='prismatic'><parent link='mid'/><child link='end'/>"
                        "<origin xyz='3 -100 0'/><axis xyz='1 0 0'/>" +
                        limit + "</joint></robot>");
  const Outcome outcome =
      run_command("robot", {robot, "--random", "200", "--samples", "0", "--hits", hits, "--record", file});
  INFO(outcome.error);
  REQUIRE(outcome.exit_code == 0);
  std::set<std::string> states;
  std::istringstream lines(read_text(hits));
  std::string line;
  std::getline(lines, line);
  while (std::getline(lines, line)) states.insert(line.substr(0, line.find(',')));
  record::Recording recording;
  REQUIRE(recording.open(file.c_str()));
  CHECK(recording.frame_count() == 200);
  std::set<std::string> frames;
  for (std::uint32_t f = 0; f < recording.frame_count(); ++f) {
    record::RecordedFrame frame;
    REQUIRE(recording.read_frame(f, &frame));
    CHECK(frame.contacts.size == frame.hits.size);
    if (!frame.hits.empty()) frames.insert(std::to_string(f));
  }
  CHECK(states.size() > 5);
  CHECK(frames == states);
  const Outcome refused = run_command("robot", {robot, "--random", "100001", "--record", file});
  CHECK(refused.exit_code == 2);
  CHECK(refused.error.find("at most 100000 are recorded") != std::string::npos);
}

TEST_CASE("wrong use of cab record and cab replay is told") {
  const TemporaryFolder folder;
  const std::string file = folder / "scene.cab";
  const auto refuses = [](const std::string& command, const Words& words, int exit_code, const std::string& told) {
    const Outcome outcome = run_command(command, words);
    INFO(outcome.error);
    CHECK(outcome.exit_code == exit_code);
    CHECK(outcome.error.find(told) != std::string::npos);
  };
  refuses("record", {"--scene", "circus", "--out", file}, 2, "a scene; choose chains3, ");
  refuses("record", {"--scene", "battle", "--out", file}, 2, "a scene; choose ");
  refuses("record", {"--scene", "hand", "--characters", "9", "--out", file}, 2, "hand is no crowd");
  refuses("record", {"--scene", "uniform-100", "--characters", "9", "--out", file}, 2, "the name of uniform-100 says");
  refuses("record", {"--scene", "uniform", "--frames", "3:9", "--out", file}, 2, "from its frame 0 on");
  refuses("record", {"--scene", "uniform"}, 2, "--out");
  refuses("record", {"--scene", "hand", "--frames", "0:2", "--out", folder / "none/scene.cab"}, 1, "none");
  refuses("run", {"a.bvh", "--compress"}, 2, "--record");
  refuses("replay", {folder / "none.cab"}, 1, "none.cab: No such file");
  refuses("replay", {CAB_COMMAND}, 1, "it is not a recording of cab");
  refuses("replay", {file, "--refit", "soft"}, 2, "soft");
}

}  // namespace
}  // namespace cab::tests
