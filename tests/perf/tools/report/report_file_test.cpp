// perf/tools/report/report_file.h: what is read of recordings that are whole, cut off, damaged, or none.
#include "perf/tools/report/report_file.h"

#include <cab/record.h>
#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "tests/engine/record/lost_frames.h"
#include "tests/perf/cli/spawn.h"

namespace cab::tests {
namespace {

constexpr BatchId kAnna = {1}, kCrowd = {2};

// A hit of the second link of anna with the first link of an instance of the crowd.
struct MadeHit {
  std::uint32_t instance;
  float depth;
  BatchSlot slot = slot_of(kCrowd);
};

// A recording whose hits are made by hand.
class MadeRecording {
 public:
  explicit MadeRecording(const std::string& path, double metres_per_unit = 0) {
    record::RecorderOptions options;
    options.title = "made";
    options.metres_per_unit = metres_per_unit;
    options.seconds_per_frame = 0.5;
    must(recorder_.open(path.c_str(), options));
    const std::int32_t parents[] = {-1, 0};
    Leaf leaves[2];
    for (std::uint32_t l = 0; l < 2; ++l)
      leaves[l] = {l, {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {1, 1, 1}}, {}};
    ArticulationDesc desc;
    desc.link_parents = parents;
    desc.leaves = leaves;
    const char* const links[] = {"hips", "arm"};
    must(recorder_.add_articulation({1}, desc, {"rig", links}));
    must(recorder_.add_batch(kAnna, {{1}, 1}, {"anna", {}}));
    must(recorder_.add_batch(kCrowd, {{1}, 3}, {"crowd", {}}));
    for (std::size_t i = 0; i < poses_.size(); i += 7) poses_[i + 3] = 1;
  }

  // A frame; contacts have a depth only if `has_contacts`. A depth that is NaN is a contact that FCL did not give.
  void add(const std::vector<MadeHit>& made, bool has_contacts = true) {
    std::vector<Hit> hits;
    std::vector<Contact> contacts;
    for (const MadeHit& hit : made) {
      hits.push_back({slot_of(kAnna), 0, hit.slot, hit.instance, 1, 0, 1, 0});
      Contact& contact = contacts.emplace_back();
      contact = {};
      if (std::isnan(hit.depth)) continue;
      contact.normal[0] = 1;
      contact.depth = hit.depth;
    }
    BatchInput inputs[2];
    inputs[0].batch = kAnna;
    inputs[1].batch = kCrowd;
    for (BatchInput& input : inputs) input.poses.data = poses_.data();
    const PairRule rule = {kAnna, kCrowd, Pairing::kBetween};
    FrameJob job;
    job.inputs = inputs;
    job.rules = {&rule, 1};
    job.hits = hits;
    if (has_contacts) job.contacts = contacts;
    job.hit_count = hits.size();
    must(recorder_.add_frame(job, 10 + 0.5 * frame_++));
  }
  void end_chunk() { must(recorder_.flush()); }
  void close() { must(recorder_.close()); }
  std::uint64_t bytes() const { return recorder_.byte_count(); }

 private:
  void must(bool ok) {
    INFO(recorder_.error());
    REQUIRE(ok);
  }
  record::Recorder recorder_;
  std::vector<float> poses_ = std::vector<float>(std::size_t{3} * 2 * 7);
  std::uint32_t frame_ = 0;
};

struct Read {
  perf::ReportFile file;
  std::vector<perf::Interval> intervals;
};

Read read(const std::string& path) {
  Read result;
  double share = 0;
  result.file = perf::read_report_file(
      path, 4, [&](const perf::Interval& interval) { result.intervals.push_back(interval); },
      [&](double now) {
        CHECK(now >= share);
        share = now;
      });
  CHECK(share == 1);
  return result;
}

bool contains(const std::vector<std::string>& lines, const std::string& text) {
  for (const std::string& line : lines)
    if (line.find(text) != std::string::npos) return true;
  return false;
}

TEST_CASE("a whole recording: its intervals, names and figures") {
  const TemporaryFolder folder;
  const std::string path = folder / "a.cab";
  MadeRecording recording(path);
  recording.add({{0, 0.25f}, {2, 1}});
  recording.add({{0, 0.5f}});
  recording.add({});
  recording.close();
  const auto [file, intervals] = read(path);
  CHECK(file.is_open);
  CHECK(file.title == "made");
  CHECK(file.frames == 3);
  CHECK(file.frames_read == 3);
  CHECK(file.seconds_per_frame == 0.5);
  CHECK(file.metres_per_unit == 0);
  CHECK(file.bytes == recording.bytes());
  CHECK(file.has_depths);
  CHECK(file.problems.empty());
  REQUIRE(intervals.size() == 2);
  CHECK(intervals[0].links.b.instance == 2);
  CHECK(intervals[1].file == 4);
  CHECK(intervals[1].frames() == 2);
  CHECK(intervals[1].worst.frame == 1);
  CHECK(intervals[1].worst.seconds == 10.5);
  CHECK(intervals[1].worst_depth == 0.5f);
  CHECK(file.names.character(intervals[0].links.a) == "anna");
  CHECK(file.names.character(intervals[0].links.b) == "crowd 2");
  CHECK(file.names.link(intervals[0].links.a) == "arm");
  CHECK(file.names.link(intervals[0].links.b) == "hips");
}

TEST_CASE("depths are in metres where the unit is known, and none is made up") {
  const TemporaryFolder folder;
  const std::string path = folder / "a.cab";
  {
    MadeRecording recording(path, 0.01);
    recording.add({{0, 25}, {1, std::nanf("")}});
    recording.close();
  }
  Read result = read(path);
  REQUIRE(result.intervals.size() == 2);
  CHECK(result.intervals[0].worst_depth == 0.25f);
  CHECK(std::isnan(result.intervals[1].worst_depth));
  {
    MadeRecording recording(path, 0.01);
    recording.add({{0, 25}}, false);
    recording.close();
  }
  result = read(path);
  REQUIRE(result.intervals.size() == 1);
  CHECK(std::isnan(result.intervals[0].worst_depth));
  CHECK_FALSE(result.file.has_depths);
}

// A character between a static body and a triangle of a static mesh, and another character.
TEST_CASE("the point of a contact is in the world, in metres, whatever its first link is of") {
  const TemporaryFolder folder;
  const std::string path = folder / "a.cab";
  record::Recorder recorder;
  const auto must = [&](bool ok) {
    INFO(recorder.error());
    REQUIRE(ok);
  };
  record::RecorderOptions options;
  options.metres_per_unit = 0.5;
  must(recorder.open(path.c_str(), options));
  StaticBody body;
  body.origin[0] = 100;
  const float vertices[] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  const std::uint32_t triangle[] = {0, 1, 2};
  StaticDesc level;
  level.bodies = {&body, 1};
  level.vertices = vertices;
  level.triangles = triangle;
  level.origin[1] = 200;
  const std::int32_t parents[] = {-1};
  Leaf leaf;
  ArticulationDesc desc;
  desc.link_parents = parents;
  desc.leaves = {&leaf, 1};
  constexpr BatchId kLevel = {1}, kPeople = {2};
  must(recorder.add_static_batch(kLevel, level));
  must(recorder.add_articulation({1}, desc));
  must(recorder.add_batch(kPeople, {{1}, 2}));
  const std::vector<float> poses = {0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0};
  const std::vector<double> origins = {7, 8, 9, 0, 0, 300};
  BatchInput inputs[2];
  inputs[0].batch = kLevel;
  inputs[1].batch = kPeople;
  inputs[1].poses.data = poses.data();
  inputs[1].origins = origins;
  Hit hits[] = {{slot_of(kLevel), 0, slot_of(kPeople), 0, 0, 0, 0, 0},
                {slot_of(kLevel), 1, slot_of(kPeople), 0, 0, 0, 0, 0},
                {slot_of(kPeople), 1, slot_of(kPeople), 0, 0, 0, 0, 0}};
  Contact contacts[3] = {};
  for (Contact& contact : contacts) {
    contact.normal[0] = 1;
    contact.depth = 1;
    contact.point_a[0] = 2;
    contact.point_b[0] = 4;
    contact.point_b[2] = -2;
  }
  FrameJob job;
  job.inputs = inputs;
  job.hits = hits;
  job.contacts = contacts;
  job.hit_count = 3;
  must(recorder.add_frame(job, 0));
  must(recorder.close());
  const std::vector<perf::Interval> intervals = read(path).intervals;
  REQUIRE(intervals.size() == 3);
  const double expected[3][3] = {{51.5, 0, -0.5}, {1.5, 100, -0.5}, {1.5, 0, 149.5}};
  for (std::size_t i = 0; i < 3; ++i) {
    CAPTURE(i);
    CHECK(intervals[i].worst_point.x == expected[i][0]);
    CHECK(intervals[i].worst_point.y == expected[i][1]);
    CHECK(intervals[i].worst_point.z == expected[i][2]);
  }
}

TEST_CASE("of a recording that is cut off or damaged what is whole is read, and the rest is told") {
  const TemporaryFolder folder;
  const std::string path = folder / "a.cab";
  MadeRecording recording(path);
  std::vector<std::uint64_t> ends;
  for (int chunk = 0; chunk < 3; ++chunk) {
    for (int f = 0; f < 4; ++f) recording.add({{1, 1}});
    recording.end_chunk();
    ends.push_back(recording.bytes());
  }
  recording.close();
  const std::string whole = read_text(path);

  write_text(path, whole.substr(0, ends[1] + 100));
  Read result = read(path);
  CHECK(result.file.frames_read == 8);
  CHECK(contains(result.file.problems, "is cut off"));
  REQUIRE(result.intervals.size() == 1);
  CHECK(result.intervals[0].frames() == 8);

  std::string damaged = whole;
  damaged[ends[1] - 20] = static_cast<char>(damaged[ends[1] - 20] ^ 1);
  write_text(path, damaged);
  result = read(path);
  CHECK(result.file.frames == 12);
  CHECK(result.file.frames_read == 8);
  CHECK(contains(result.file.problems, "frames 4 to 7 are left out"));
  CHECK_FALSE(contains(result.file.problems, path));
  REQUIRE(result.intervals.size() == 2);
  CHECK(result.intervals[0].last.frame == 3);
  CHECK(result.intervals[1].first.frame == 8);
}

TEST_CASE("a hit of an instance that is not there makes its frame unreadable, and no other") {
  for (const MadeHit& wrong : {MadeHit{3, 1}, MadeHit{0, 1, {9}}}) {
    const TemporaryFolder folder;
    const std::string path = folder / "a.cab";
    MadeRecording recording(path);
    recording.add({{0, 1}});
    recording.add({wrong});
    recording.add({{0, 1}});
    recording.close();
    const auto [file, intervals] = read(path);
    CHECK(file.frames_read == 2);
    REQUIRE(file.problems.size() == 1);
    CHECK(file.problems[0].find("frame 1 is left out: ") == 0);
    CHECK(file.problems[0].find("a hit names what the frame does not have") != std::string::npos);
    CHECK(intervals.size() == 2);
  }
}

TEST_CASE("numbers that no run computes are unknown, not a depth or a length") {
  const TemporaryFolder folder;
  const std::string path = folder / "a.cab";
  const float infinity = std::numeric_limits<float>::infinity();
  MadeRecording recording(path, 0);
  recording.add({{0, infinity}, {1, -infinity}, {2, 0.5f}});
  recording.close();
  const auto [file, intervals] = read(path);
  CHECK(file.metres_per_unit == 0);
  REQUIRE(intervals.size() == 3);
  CHECK(std::isnan(intervals[0].worst_depth));
  CHECK(std::isnan(intervals[1].worst_depth));
  CHECK(intervals[2].worst_depth == 0.5f);
}

TEST_CASE("millions of frames that a small file claims are left out in one line, and in few steps") {
  const TemporaryFolder folder;
  const std::string path = folder / "hostile.cab";
  MadeRecording recording(path);
  for (int f = 0; f < 3; ++f) recording.add({{0, 0.5f}});
  recording.close();
  write_text(path, read_text(path) + claimed_gaps(3));
  std::size_t steps = 0;
  const perf::ReportFile file = perf::read_report_file(
      path, 0, [](const perf::Interval&) {}, [&](double) { ++steps; });
  CHECK(file.frames == 16777220);
  CHECK(file.frames_read == 3);
  CHECK(steps == 5);  // a frame each, the gap, and the chunk behind it
  CHECK(contains(file.problems, "frames 3 to 16777219 are left out: "));
}

TEST_CASE("what is no recording is one problem") {
  const TemporaryFolder folder;
  write_text(folder / "text", "no recording");
  write_text(folder / "empty", "");
  for (const char* const name : {"text", "empty", "none"}) {
    CAPTURE(name);
    const auto [file, intervals] = read(folder / name);
    CHECK_FALSE(file.is_open);
    CHECK(file.frames_read == 0);
    CHECK(file.problems.size() == 1);
    CHECK(intervals.empty());
  }
}

}  // namespace
}  // namespace cab::tests
