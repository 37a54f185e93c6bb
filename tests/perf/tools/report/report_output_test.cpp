// perf/tools/report/report_output.h: the rows of CSV, and the JSON of the page.
#include "perf/tools/report/report_output.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

namespace cab::tests {
namespace {

using Json = nlohmann::json;

constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();

perf::ReportFile made_file() {
  perf::ReportFile file;
  file.path = "a, \"b\".cab";
  file.title = "<two>\xff";
  file.is_open = true;
  file.frames = 10;
  file.frames_read = 8;
  file.seconds_per_frame = 0.25;
  file.metres_per_unit = 1;
  file.problems = {"frames 8 to 9 are left out"};
  file.names = {{{"anna", {}, 1, 3, false, 0}, {"ben", {}, 1, 5, false, 0}}, {{"hips", "arm"}}};
  return file;
}

const perf::LinkPlaces kLinks = {{0, 0, 1}, {1, 0, 0}};
const perf::Interval kInterval = {0, kLinks, {2, 0.5}, {5, 1.25}, {4, 1}, 0.1f};
const perf::PairTotals kTotals = {0, kLinks, 6, 2, 4, {4, 1}, 0.1f};

template <class Write>
std::string text_of(const Write& write) {
  std::ostringstream out;
  write(out);
  return out.str();
}

TEST_CASE("rows of CSV: names are quoted where need be, and an unknown depth is empty") {
  const perf::ReportFile file = made_file();
  const std::string links = "\"a, \"\"b\"\".cab\",anna,arm,ben,hips,";
  CHECK(text_of([&](std::ostream& out) { perf::write_interval(out, file, kInterval); }) ==
        links + "2,5,4,0.5,1.25,0.1,,4,1,,,,\n");
  perf::Interval unknown = kInterval;
  unknown.worst_depth = kUnknown;
  unknown.first.seconds = std::numeric_limits<double>::infinity();
  CHECK(text_of([&](std::ostream& out) { perf::write_interval(out, file, unknown); }) ==
        links + "2,5,4,,1.25,,,4,1,,,,\n");
  unknown.worst_triangles = 25;
  unknown.worst_point = {0.5, -2, 7};
  CHECK(text_of([&](std::ostream& out) { perf::write_interval(out, file, unknown); }) ==
        links + "2,5,4,,1.25,,25,4,1,0.5,-2,7,\n");
  CHECK(text_of([&](std::ostream& out) { perf::write_pair(out, file, kTotals); }) ==
        links + "6,0.75,2,4,0.1,,4,1,,,\n");
}

TEST_CASE("a row of CSV has as many fields as its header") {
  perf::ReportFile file = made_file();
  file.path = "a.cab";
  const auto fields = [](const std::string& text) {
    CHECK(std::count(text.begin(), text.end(), '\n') == 1);
    return std::count(text.begin(), text.end(), ',');
  };
  const auto of_header = fields(text_of([](std::ostream& out) { perf::write_interval_header(out); }));
  CHECK(fields(text_of([&](std::ostream& out) { perf::write_interval(out, file, kInterval); })) == of_header);
  CHECK(fields(text_of([&](std::ostream& out) { perf::write_problem(out, file, "damaged"); })) == of_header);
  CHECK(fields(text_of([&](std::ostream& out) { perf::write_pair(out, file, kTotals); })) ==
        fields(text_of([](std::ostream& out) { perf::write_pair_header(out); })));
}

TEST_CASE("the share is that of the frames that were read") {
  perf::ReportFile file = made_file();
  CHECK(perf::share_of_frames(file, kTotals) == 0.75);
  file.frames_read = 0;
  CHECK(perf::share_of_frames(file, kTotals) == 0);
}

TEST_CASE("the JSON of the page has all members, and decimals without digits that a float does not have") {
  perf::ReportPage page;
  page.interval_count = 5;
  page.pair_count = 4;
  page.recordings = {0, std::nullopt};
  page.csv_name = "r.csv";
  const std::vector<perf::ReportFile> files = {made_file(), {}};
  Json json = Json::parse(perf::report_json(files, page));
  CHECK(json["intervals"].empty());
  CHECK(json["pairs"].empty());
  CHECK(json["min_depth"].is_null());
  page.intervals = {kInterval, kInterval};
  page.intervals[1].worst_depth = kUnknown;
  page.intervals[1].worst_triangles = 25;
  page.intervals[1].worst_point = {0.5, -2, 7};
  page.pairs = {kTotals};
  page.min_depth = 0.01;
  page.min_frames = 2;
  const std::string text = perf::report_json(files, page);
  CHECK(text.find("\"worst_depth\":0.1,") != std::string::npos);
  json = Json::parse(text);
  CHECK(json["version"].is_string());
  CHECK(json["csv"] == "r.csv");
  CHECK(json["min_depth"] == 0.01);
  CHECK(json["min_frames"] == 2);
  CHECK(json["interval_count"] == 5);
  CHECK(json["pair_count"] == 4);
  CHECK(json["files"][0] == Json({{"name", "a, \"b\".cab"},
                                  {"title", "<two>\xef\xbf\xbd"},
                                  {"recording", 0},
                                  {"frames", 10},
                                  {"frames_read", 8},
                                  {"seconds_per_frame", 0.25},
                                  {"metres_per_unit", 1.0},
                                  {"problems", {"frames 8 to 9 are left out"}}}));
  CHECK(json["files"][1]["recording"].is_null());
  const Json links = {{"file", 0},        {"character_a", "anna"}, {"link_a", "arm"},     {"character_b", "ben"},
                      {"link_b", "hips"}, {"a", Json({3, 0, 1})},  {"b", Json({5, 0, 0})}};
  Json interval = links, pair = links;
  interval.update({{"first", 2},
                   {"last", 5},
                   {"frames", 4},
                   {"first_seconds", 0.5},
                   {"last_seconds", 1.25},
                   {"worst_depth", 0.1},
                   {"worst_triangles", nullptr},
                   {"worst_frame", 4},
                   {"worst_seconds", 1.0},
                   {"worst_point", nullptr}});
  pair.update({{"frames", 6},
               {"share", 0.75},
               {"intervals", 2},
               {"longest", 4},
               {"worst_depth", 0.1},
               {"worst_triangles", nullptr},
               {"worst_frame", 4},
               {"worst_seconds", 1.0},
               {"worst_point", nullptr}});
  CHECK(json["intervals"][0] == interval);
  CHECK(json["pairs"][0] == pair);
  CHECK(json["intervals"][1]["worst_depth"].is_null());
  CHECK(json["intervals"][1]["worst_triangles"] == 25);
  CHECK(json["intervals"][1]["worst_point"] == Json({0.5, -2.0, 7.0}));
}

}  // namespace
}  // namespace cab::tests
