#include "perf/tools/report/report_output.h"

#include <cab/version.h>

#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "perf/base/report.h"

namespace cab::perf {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kLinkColumns = "file,character_a,link_a,character_b,link_b";

void write_links(std::ostream& out, const ReportFile& file, const LinkPlaces& links) {
  out << csv_field(file.path) << ',' << csv_field(file.names.character(links.a)) << ','
      << csv_field(file.names.link(links.a)) << ',' << csv_field(file.names.character(links.b)) << ','
      << csv_field(file.names.link(links.b));
}

// Empty for what is unknown.
template <class Number>
std::string number_field(Number number) {
  return std::isfinite(number) ? shortest(number) : std::string();
}
std::string count_field(std::uint32_t count) { return count > 0 ? std::to_string(count) : std::string(); }

constexpr const char* kWorstColumns = "worst_depth,worst_triangles,worst_frame,worst_seconds,worst_x,worst_y,worst_z";

// Of an interval or a pair.
template <class Row>
void write_worst(std::ostream& out, const Row& row) {
  out << number_field(row.worst_depth) << ',' << count_field(row.worst_triangles) << ',' << row.worst.frame << ','
      << number_field(row.worst.seconds) << ',' << number_field(row.worst_point.x) << ','
      << number_field(row.worst_point.y) << ',' << number_field(row.worst_point.z);
}

// The shortest decimal number of a float, so that JSON has no digits that the float does not have.
Json decimal(float value) {
  if (!std::isfinite(value)) return nullptr;
  return std::strtod(shortest(value).c_str(), nullptr);
}

std::string compact(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

Json place_json(const ReportFile& file, const LinkPlace& place) {
  return {file.names.batches[place.batch].slot, place.instance, place.link};
}

Json links_json(const ReportFile& file, std::uint32_t index, const LinkPlaces& links) {
  return {{"file", index},
          {"character_a", file.names.character(links.a)},
          {"link_a", file.names.link(links.a)},
          {"character_b", file.names.character(links.b)},
          {"link_b", file.names.link(links.b)},
          {"a", place_json(file, links.a)},
          {"b", place_json(file, links.b)}};
}

template <class Row>
void add_worst(Json& json, const Row& row) {
  const WorldPoint& point = row.worst_point;
  json["worst_depth"] = decimal(row.worst_depth);
  json["worst_triangles"] = row.worst_triangles > 0 ? Json(row.worst_triangles) : Json();
  json["worst_frame"] = row.worst.frame;
  json["worst_seconds"] = row.worst.seconds;
  json["worst_point"] = std::isfinite(point.x + point.y + point.z) ? Json({point.x, point.y, point.z}) : Json();
}

Json interval_json(const ReportFile& file, const Interval& interval) {
  Json json = links_json(file, interval.file, interval.links);
  json["first"] = interval.first.frame;
  json["last"] = interval.last.frame;
  json["frames"] = interval.frames();
  json["first_seconds"] = interval.first.seconds;
  json["last_seconds"] = interval.last.seconds;
  add_worst(json, interval);
  return json;
}

Json pair_json(const ReportFile& file, const PairTotals& pair) {
  Json json = links_json(file, pair.file, pair.links);
  json["frames"] = pair.frames;
  json["share"] = share_of_frames(file, pair);
  json["intervals"] = pair.intervals;
  json["longest"] = pair.longest;
  add_worst(json, pair);
  return json;
}

Json file_json(const ReportFile& file, const std::optional<std::uint32_t>& recording) {
  return {{"name", file.path},
          {"title", file.title},
          {"recording", recording ? Json(*recording) : Json()},
          {"frames", file.frames},
          {"frames_read", file.frames_read},
          {"seconds_per_frame", file.seconds_per_frame},
          {"metres_per_unit", file.metres_per_unit},
          {"problems", file.problems}};
}

// Appends `"key":[...]`, one row at a time: all rows as one tree would take several times the memory of the text.
template <class Rows, class ToJson>
void append_rows(std::string& text, const char* key, const Rows& rows, const ToJson& to_json) {
  text += std::string(",\n\"") + key + "\":[";
  for (std::size_t r = 0; r < rows.size(); ++r) {
    if (r > 0) text += ",\n";
    text += compact(to_json(rows[r]));
  }
  text += ']';
}

}  // namespace

void write_interval_header(std::ostream& out) {
  out << kLinkColumns << ",first_frame,last_frame,frames,first_seconds,last_seconds," << kWorstColumns << ",problem\n";
}

void write_interval(std::ostream& out, const ReportFile& file, const Interval& interval) {
  write_links(out, file, interval.links);
  out << ',' << interval.first.frame << ',' << interval.last.frame << ',' << interval.frames() << ','
      << number_field(interval.first.seconds) << ',' << number_field(interval.last.seconds) << ',';
  write_worst(out, interval);
  out << ",\n";
}

void write_problem(std::ostream& out, const ReportFile& file, const std::string& problem) {
  out << csv_field(file.path) << ",,,,,,,,,,,,,,,,," << csv_field(problem) << '\n';
}

void write_pair_header(std::ostream& out) {
  out << kLinkColumns << ",frames,share,intervals,longest_frames," << kWorstColumns << '\n';
}

void write_pair(std::ostream& out, const ReportFile& file, const PairTotals& pair) {
  write_links(out, file, pair.links);
  out << ',' << pair.frames << ',' << shortest(share_of_frames(file, pair)) << ',' << pair.intervals << ','
      << pair.longest << ',';
  write_worst(out, pair);
  out << '\n';
}

double share_of_frames(const ReportFile& file, const PairTotals& pair) {
  return file.frames_read == 0 ? 0 : static_cast<double>(pair.frames) / static_cast<double>(file.frames_read);
}

std::string report_json(const std::vector<ReportFile>& files, const ReportPage& page) {
  Json head = {{"version", CAB_VERSION_STRING},
               {"csv", page.csv_name},
               {"min_depth", page.min_depth ? Json(*page.min_depth) : Json()},
               {"min_frames", page.min_frames},
               {"interval_count", page.interval_count},
               {"pair_count", page.pair_count},
               {"files", Json::array()}};
  for (std::size_t f = 0; f < files.size(); ++f) head["files"].push_back(file_json(files[f], page.recordings[f]));
  std::string text = compact(head);
  text.pop_back();  // the closing brace
  append_rows(text, "intervals", page.intervals,
              [&](const Interval& interval) { return interval_json(files[interval.file], interval); });
  append_rows(text, "pairs", page.pairs, [&](const PairTotals& pair) { return pair_json(files[pair.file], pair); });
  return text + "}";
}

}  // namespace cab::perf
