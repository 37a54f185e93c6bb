// `cab report` from outside: what it writes, beside an independent reading of the hits, and what it refuses.
#include <doctest/doctest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "tests/perf/cli/made_motion.h"
#include "tests/perf/cli/spawn.h"
#include "tests/scenes/import/made_skin.h"

namespace cab::tests {
namespace {

using Json = nlohmann::json;
using Words = std::vector<std::string>;

constexpr const char* kViewer = "<!doctype html>\n<title>viewer</title>\n<!--CAB-DATA-->\n<script></script>\n";

// The rows of a CSV file without quotes, the header first, each as its fields.
std::vector<Words> rows_of(const std::string& text) {
  std::vector<Words> rows;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    Words& fields = rows.emplace_back();
    std::istringstream stream(line + ",");
    for (std::string field; std::getline(stream, field, ',');) fields.push_back(field);
  }
  return rows;
}

std::string field(const std::vector<Words>& rows, std::size_t row, const std::string& name) {
  const auto at = std::find(rows.at(0).begin(), rows.at(0).end(), name);
  REQUIRE(at != rows.at(0).end());
  return rows.at(row).at(static_cast<std::size_t>(at - rows.at(0).begin()));
}

// Two figures who meet, recorded, and the viewer's page.
struct Files {
  TemporaryFolder folder;
  std::string anna = folder / "anna.bvh", ben = folder / "ben.bvh", hits = folder / "hits.csv",
              recording = folder / "dance.cab", viewer = folder / "cab_view.html", page = folder / "report.html",
              csv = folder / "report.csv", pairs = folder / "pairs.csv";
  explicit Files(const Words& run_options = {}) {
    write_text(anna, bvh_text({80, 0, 0, 0}));
    write_text(ben, bvh_text({80, 7, 0.5, 0.004}));
    write_text(viewer, kViewer);
    Words words = {anna, ben, "--offset", "0,0,0", "--offset", "0,0,0.1", "--hits", hits, "--record", recording};
    words.insert(words.end(), run_options.begin(), run_options.end());
    const Outcome outcome = run_command("run", words);
    INFO(outcome.error);
    REQUIRE(outcome.exit_code == 0);
  }
  Outcome report(const Words& options) const {
    Words words = {recording, "--out", page, "--page", viewer};
    words.insert(words.end(), options.begin(), options.end());
    return run_command("report", words);
  }
  Json json() const {
    const std::string text = read_text(page), before = "id=\"cab-report\">";
    const std::size_t begin = text.find(before) + before.size();
    return Json::parse(text.substr(begin, text.find("</script>", begin) - begin));
  }
};

TEST_CASE("the first row is the worst interval by an independent reading of the hits") {
  const Files files;
  REQUIRE(files.report({}).exit_code == 0);
  const std::vector<Words> rows = rows_of(read_text(files.csv));
  const Outcome judge = spawn(CAB_PYTHON3, {CAB_WORST_INTERVAL, files.hits});
  INFO(judge.error);
  REQUIRE(judge.exit_code == 0);
  const Words expected = rows_of(judge.out).at(0);
  const char* const columns[] = {"character_a", "link_a", "character_b", "link_b",     "first_frame",
                                 "last_frame",  "frames", "worst_depth", "worst_frame"};
  REQUIRE(expected.size() == std::size(columns));
  for (std::size_t c = 0; c < expected.size(); ++c) {
    CAPTURE(columns[c]);
    if (std::string(columns[c]) == "worst_depth")
      CHECK(std::atof(field(rows, 1, columns[c]).c_str()) == std::atof(expected[c].c_str()));
    else
      CHECK(field(rows, 1, columns[c]) == expected[c]);
  }
}

TEST_CASE("the page, the CSV and the pairs say the same, worst first, and no hit is lost") {
  const Files files;
  const Outcome outcome = files.report({"--pairs", files.pairs});
  INFO(outcome.error);
  REQUIRE(outcome.exit_code == 0);
  CHECK(outcome.error.empty());
  const std::vector<Words> rows = rows_of(read_text(files.csv)), pairs = rows_of(read_text(files.pairs));
  const Json json = files.json();
  REQUIRE(json["intervals"].size() == rows.size() - 1);
  REQUIRE(json["pairs"].size() == pairs.size() - 1);
  CHECK(json["interval_count"] == rows.size() - 1);
  CHECK(json["pair_count"] == pairs.size() - 1);
  CHECK(json["csv"] == "report.csv");
  CHECK(json["files"][0]["name"] == files.recording);
  CHECK(json["files"][0]["recording"] == 0);
  CHECK(json["files"][0]["frames"] == 80);
  CHECK(json["files"][0]["frames_read"] == 80);
  std::size_t frames_of_intervals = 0, frames_of_pairs = 0;
  double last_depth = 1e9;
  for (std::size_t r = 1; r < rows.size(); ++r) {
    const Json& row = json["intervals"][r - 1];
    CHECK(row["link_a"] == field(rows, r, "link_a"));
    CHECK(std::to_string(row["worst_frame"].get<int>()) == field(rows, r, "worst_frame"));
    CHECK(row["worst_depth"] <= last_depth);
    last_depth = row["worst_depth"];
    frames_of_intervals += row["frames"].get<std::size_t>();
  }
  for (std::size_t r = 1; r < pairs.size(); ++r) {
    const Json& row = json["pairs"][r - 1];
    CHECK(row["link_b"] == field(pairs, r, "link_b"));
    CHECK(row["share"] == doctest::Approx(row["frames"].get<double>() / 80));
    frames_of_pairs += row["frames"].get<std::size_t>();
  }
  const std::size_t hits = rows_of(read_text(files.hits)).size() - 1;
  CHECK(hits > 100);
  CHECK(frames_of_intervals == hits);
  CHECK(frames_of_pairs == hits);
  CHECK(read_text(files.page).find("class=\"cab-recording\" data-name=\"dance.cab\">") != std::string::npos);
}

TEST_CASE("filters leave out intervals that are short or flat, and with them pairs") {
  const Files files;
  REQUIRE(files.report({}).exit_code == 0);
  const Json all = files.json();
  REQUIRE(files.report({"--min-depth", "0.02", "--min-frames", "3"}).exit_code == 0);
  const Json json = files.json();
  Json expected = Json::array();
  for (const Json& row : all["intervals"])
    if (row["worst_depth"] >= 0.02 && row["frames"] >= 3) expected.push_back(row);
  CHECK(expected.size() > 0);
  CHECK(expected.size() < all["intervals"].size());
  CHECK(json["intervals"] == expected);
  CHECK(json["min_depth"] == 0.02);
  CHECK(json["min_frames"] == 3);
  for (const Json& pair : json["pairs"]) CHECK(pair["longest"] >= 3);
}

TEST_CASE("without depths the longest come first, and a filter by depth is told") {
  const Files files(Words{"--exact", "none"});
  REQUIRE(files.report({}).exit_code == 0);
  const Json json = files.json();
  REQUIRE(json["intervals"].size() > 1);
  for (std::size_t r = 0; r < json["intervals"].size(); ++r) {
    CHECK(json["intervals"][r]["worst_depth"].is_null());
    if (r > 0) CHECK(json["intervals"][r]["frames"] <= json["intervals"][r - 1]["frames"]);
  }
  const Outcome outcome = files.report({"--min-depth", "0.01"});
  CHECK(outcome.exit_code == 0);
  CHECK(outcome.error.find("has no depths, so --min-depth leaves nothing of it") != std::string::npos);
  CHECK(rows_of(read_text(files.csv)).size() == 1);
}

TEST_CASE("of recorded skins the triangles are counted that touch, most first, and lie where the skins do") {
  const TemporaryFolder folder;
  const std::string file = folder / "boxes.glb", recording = folder / "boxes.cab", csv = folder / "boxes.csv";
  write_text(file, glb(two_boxes()));
  const Outcome run = run_command("run", {file, file, "--offset", "0,0,0", "--offset", "0.5,0,0", "--body", "surface",
                                          "--animation", "out", "--record", recording});
  INFO(run.error);
  REQUIRE(run.exit_code == 0);
  const Outcome replay = run_command("replay", {recording});
  INFO(replay.out);
  CHECK(replay.exit_code == 0);
  CHECK(run_command("replay", {recording, "--exact", "convex"}).error.find("articulation with a skin") !=
        std::string::npos);
  const Outcome report = run_command("report", {recording, "--csv", csv});
  INFO(report.error);
  REQUIRE(report.exit_code == 0);
  CHECK(report.out.find("triangles") != std::string::npos);
  const std::vector<Words> rows = rows_of(read_text(csv));
  REQUIRE(rows.size() > 2);
  double last = 1e9;
  for (std::size_t r = 1; r < rows.size(); ++r) {
    CHECK(field(rows, r, "worst_depth").empty());
    const double triangles = std::atof(field(rows, r, "worst_triangles").c_str());
    CHECK(triangles >= 1);
    CHECK(triangles <= last);
    last = triangles;
    // Each figure is 2 wide, and the second half a metre beside the first.
    const double x = std::atof(field(rows, r, "worst_x").c_str()), y = std::atof(field(rows, r, "worst_y").c_str());
    CHECK(x >= -1 - 1e-6);
    CHECK(x <= 1.5 + 1e-6);
    CHECK(y >= -1 - 1e-6);
    CHECK(y <= 1 + 1e-6);
  }
}

TEST_CASE("one bad file among good ones is a row with its error, and the exit code is 1") {
  const Files files;
  const std::string bad = files.folder / "bad.cab", cut = files.folder / "cut.cab";
  write_text(bad, "no recording");
  const std::string whole = read_text(files.recording);
  write_text(cut, whole.substr(0, whole.size() - 8));
  const Outcome outcome = files.report({bad, cut});
  CHECK(outcome.exit_code == 1);
  CHECK(outcome.error.find("error: " + bad + ": ") != std::string::npos);
  CHECK(outcome.error.find(cut + ": ") != std::string::npos);
  CHECK(outcome.out.find("cannot be read") != std::string::npos);
  const Json json = files.json();
  CHECK(json["files"].size() == 3);
  CHECK(json["files"][1]["recording"].is_null());
  CHECK(json["files"][1]["problems"].size() == 1);
  CHECK(json["intervals"].size() > 0);
  const std::string csv = read_text(files.csv);
  CHECK(csv.find("\n" + bad + ",,,,,,,,,,,,,,,,,") != std::string::npos);
}

TEST_CASE("without the page of the viewer the CSV is written, and the reason why there is no page is told") {
  const Files files;
  // A copy of the command stands beside no page.
  const std::string command = files.folder / "cab";
  std::filesystem::copy_file(CAB_COMMAND, command);
  const Outcome outcome = spawn(command, {"report", files.recording, "--out", files.page});
  CHECK(outcome.exit_code == 1);
  CHECK(outcome.error.find(files.page + " is not written: the page of the viewer") != std::string::npos);
  CHECK_FALSE(std::filesystem::exists(files.page));
  CHECK(rows_of(read_text(files.csv)).size() > 1);
  CHECK(spawn(command, {"report", files.recording, "--csv", files.pairs}).exit_code == 0);
  CHECK(read_text(files.pairs) == read_text(files.csv));
}

TEST_CASE("a page that goes to standard output is alone there, and no CSV file is beside it") {
  const Files files;
  const Words words = {files.recording, "--page", files.viewer, "--out", "/dev/stdout"};
  Words piped = {"-c", "set -o pipefail; \"$@\" | cat", "bash", CAB_COMMAND, "report"};
  piped.insert(piped.end(), words.begin(), words.end());
  for (const Outcome& outcome : {spawn("/bin/bash", piped), run_command("report", words)}) {
    INFO(outcome.error);
    CHECK(outcome.exit_code == 0);
    CHECK(outcome.error.find("/dev/stdout: 1 of 1 recordings inside") != std::string::npos);
    CHECK(outcome.error.find("csv") == std::string::npos);
    CHECK(outcome.out.rfind("<!doctype html>\n", 0) == 0);
    const std::string end = "<script></script>\n";
    REQUIRE(outcome.out.size() > end.size());
    CHECK(outcome.out.substr(outcome.out.size() - end.size()) == end);
  }
}

TEST_CASE("wrong use is refused before anything is read or written") {
  const Files files;
  const auto refused = [&](const Words& words, const std::string& why) {
    const Outcome outcome = run_command("report", words);
    CAPTURE(outcome.error);
    CHECK(outcome.exit_code == 2);
    CHECK(outcome.error.find(why) != std::string::npos);
  };
  refused({files.recording}, "no output; give --out REPORT.html, or --csv REPORT.csv");
  refused({files.recording, "--csv", files.recording}, "is an input");
  refused({files.recording, "--out", files.page, "--csv", files.page}, "name the same file");
  refused({files.recording, "--out", files.folder / "a.csv"}, "name the same file");
  refused({files.recording, "--out", files.page, "--min-depth", "-1"}, "--min-depth: '-1' is not a number");
  refused({files.recording, "--out", files.page, "--min-frames", "0"}, "--min-frames");
  refused({"--out", files.page}, "FILE");
  CHECK_FALSE(std::filesystem::exists(files.page));
  const Outcome outcome = run_command("report", {files.recording, "--out", files.page, "--page", files.anna});
  CHECK(outcome.exit_code == 1);
  CHECK(outcome.error.find(files.anna + " is no page of the viewer") != std::string::npos);
}

}  // namespace
}  // namespace cab::tests
