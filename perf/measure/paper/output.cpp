#include "perf/measure/paper/output.h"

#include <cab/cab.h>

#include <algorithm>
#include <iostream>
#include <nlohmann/json.hpp>

#include "perf/base/report.h"

namespace cab::perf {
namespace {

using Json = nlohmann::ordered_json;

// The time that a frame may take, by the paper's measure.
constexpr double kFrameSeconds = 1.0 / 30;

const MethodRun* find_cab(const TableRun& run) {
  const auto is_cab = [](const MethodRun& method) { return method.method.paper == PaperMethod::kCab; };
  const auto found = std::find_if(run.runs.begin(), run.runs.end(), is_cab);
  return found == run.runs.end() ? nullptr : &*found;
}

// a over b, or a dash if one of them is 0.
std::string ratio(double a, double b, int decimals = 2) { return b > 0 && a > 0 ? fixed(a / b, decimals) : "-"; }
std::string percent(double part, double whole) { return whole > 0 ? fixed(100 * part / whole, 1) : "-"; }

// Prints the paper's columns, by FCL, and those that differ by convex.
void print_columns(const TableRun& run) {
  TextTable text;
  text.add_row({"", "#coll", "#false", "t[query]", "t[upd]", "t[test]", "t[total]", "hits", "box tests",
                "convex: t[query]", "t[total]", "hits"});
  for (const MethodRun& method : run.runs) {
    const FrameStats& s = method.stats;
    std::vector<std::string> cells = {method.method.name,
                                      std::to_string(s.leaf_pairs),
                                      std::to_string(method.false_positives()),
                                      fixed(method.fcl.seconds_query, 4),
                                      fixed(s.seconds_update, 4),
                                      fixed(s.seconds_test, 4),
                                      fixed(method.total_seconds(method.fcl), 4),
                                      std::to_string(method.fcl.hits),
                                      std::to_string(s.box_tests)};
    const std::optional<ExactRun>& convex = method.convex;
    cells.push_back(convex ? fixed(convex->seconds_query, 4) : "-");
    cells.push_back(convex ? fixed(method.total_seconds(*convex), 4) : "-");
    cells.push_back(convex ? std::to_string(convex->hits) : "-");
    text.add_row(std::move(cells));
    if (!method.method.paper) continue;
    const PaperRow& p = run.table->row(*method.method.paper);
    text.add_row({"  the paper", std::to_string(p.coll), std::to_string(p.false_positives), fixed(p.query_seconds, 2),
                  fixed(p.update_seconds, 2), fixed(p.test_seconds, 2), fixed(p.total_seconds, 2),
                  std::to_string(p.hits()), "-", "-", "-", "-"});
  }
  text.print(std::cout);
}

// Prints what follows from these columns: ratios to CAB, the time of one frame, the shares of the phases.
void print_ratios(const TableRun& run) {
  const MethodRun* cab = find_cab(run);
  if (!cab) return;
  const PaperRow& papers_cab = run.table->row(PaperMethod::kCab);
  TextTable text;
  text.add_row({"", "t[total]/CAB", "paper", "t[upd]/CAB", "paper", "ms/frame", "paper", "% of 1/30 s", "% query",
                "% contact", "% upd", "% test", "area/CAB", "convex: t[total]/CAB", "% query", "% contact"});
  for (const MethodRun& method : run.runs) {
    const FrameStats& s = method.stats;
    const double total = method.total_seconds(method.fcl), frame = total / run.frame_count;
    const std::optional<ExactRun>& convex = method.convex;
    const PaperRow* p = method.method.paper ? &run.table->row(*method.method.paper) : nullptr;
    text.add_row({method.method.name, ratio(total, cab->total_seconds(cab->fcl)),
                  p ? ratio(p->total_seconds, papers_cab.total_seconds) : "-",
                  ratio(s.seconds_update, cab->stats.seconds_update),
                  p ? ratio(p->update_seconds, papers_cab.update_seconds) : "-", fixed(1e3 * frame, 5),
                  p ? fixed(1e3 * p->total_seconds / run.table->frame_count, 2) : "-",
                  fixed(100 * frame / kFrameSeconds, 3), percent(method.fcl.seconds_query, total),
                  percent(method.fcl.seconds_contact, total), percent(s.seconds_update, total),
                  percent(s.seconds_test, total), ratio(method.mean_area, cab->mean_area, 4),
                  convex ? ratio(method.total_seconds(*convex), cab->total_seconds(*cab->convex)) : "-",
                  convex ? percent(convex->seconds_query, method.total_seconds(*convex)) : "-",
                  convex ? percent(convex->seconds_contact, method.total_seconds(*convex)) : "-"});
  }
  text.print(std::cout);
}

Json convex_json(const MethodRun& method, const ExactRun& run) {
  return {{"hits", run.hits},
          {"query_thread_seconds", run.seconds_query},
          {"contact_thread_seconds", run.seconds_contact},
          {"total_thread_seconds", method.total_seconds(run)},
          {"hits_hash", hex(run.hits_hash)}};
}

Json paper_json(const PaperRow& row) {
  return {{"coll", row.coll},
          {"false_positives", row.false_positives},
          {"hits", row.hits()},
          {"query_seconds", row.query_seconds},
          {"update_seconds", row.update_seconds},
          {"test_seconds", row.test_seconds},
          {"total_seconds", row.total_seconds}};
}

Json method_json(const TableRun& run, const MethodRun& method) {
  const FrameStats& s = method.stats;
  Json json;
  json["method"] = method.method.name;
  json["policies"] = policies_json(method.method.policies);
  json["on_meshes"] = method.method.on_meshes;
  json["coll"] = s.leaf_pairs;
  json["false_positives"] = method.false_positives();
  json["hits"] = method.fcl.hits;
  json["box_tests"] = s.box_tests;
  json["query_thread_seconds"] = method.fcl.seconds_query;
  json["contact_thread_seconds"] = method.fcl.seconds_contact;
  json["update_thread_seconds"] = s.seconds_update;
  json["test_thread_seconds"] = s.seconds_test;
  json["total_thread_seconds"] = method.total_seconds(method.fcl);
  json["total_wall_seconds"] = s.seconds_total;
  json["mean_inner_box_area"] = method.mean_area;
  json["hits_hash"] = hex(method.fcl.hits_hash);
  json["box_hits_hash"] = hex(method.box_hits_hash);
  json["convex"] = method.convex ? convex_json(method, *method.convex) : Json();
  json["paper"] = method.method.paper ? paper_json(run.table->row(*method.method.paper)) : Json();
  return json;
}

}  // namespace

void print_table(const TableRun& run) {
  std::cout << "Table " << run.table->number << ": " << run.table->title << ", " << run.frame_count << " frames ("
            << cab::to_string(run.isa) << ", threads " << run.thread_count << ")\n";
  print_columns(run);
  std::cout << '\n';
  print_ratios(run);
  std::cout << "  hashes: poses " << hex(run.pose_hash) << ", boxes of CAB " << hex(run.box_hash) << ", box hits "
            << hex(run.box_hit_hash) << '\n';
  if (!run.is_full()) std::cout << "  " << describe(run.added) << '\n';
  for (const Gate& gate : run.gates) std::cout << (gate.passed ? "  ok    " : "  FAIL  ") << gate.text << '\n';
  if (!run.is_full())
    std::cout << "  The paper's counts are compared in a run of all " << run.table->frame_count << " frames only.\n";
  std::cout << std::endl;
}

void write_paper_json(OutputFile& file, const std::vector<TableRun>& tables) {
  Json json;
  json["cab_version"] = CAB_VERSION_STRING;
  json["tables"] = Json::array();
  for (const TableRun& run : tables) {
    Json table;
    table["table"] = run.table->number;
    table["title"] = run.table->title;
    table["frame_count"] = run.frame_count;
    table["full_run"] = run.is_full();
    table["isa"] = cab::to_string(run.isa);
    table["threads"] = run.thread_count;
    table["pose_hash"] = hex(run.pose_hash);
    table["box_hash"] = hex(run.box_hash);
    table["box_hit_hash"] = hex(run.box_hit_hash);
    table["added_false_positives"] = {{"found", run.added.found},           {"touching", run.added.touching},
                                      {"by_padding", run.added.by_padding}, {"by_slack", run.added.by_slack},
                                      {"missed", run.added.missed},         {"percent", run.added.percent()}};
    table["methods"] = Json::array();
    for (const MethodRun& method : run.runs) table["methods"].push_back(method_json(run, method));
    table["gates"] = Json::array();
    for (const Gate& gate : run.gates) table["gates"].push_back({{"gate", gate.text}, {"passed", gate.passed}});
    json["tables"].push_back(table);
  }
  write_json(file, json);
}

void write_paper_csv(OutputFile& file, const std::vector<TableRun>& tables) {
  std::vector<Json> rows;
  for (const TableRun& run : tables)
    for (const MethodRun& method : run.runs) {
      Json row = {{"table", run.table->number},    {"method", method.method.name},
                  {"frames", run.frame_count},     {"isa", cab::to_string(run.isa)},
                  {"threads", run.thread_count},   {"pose_hash", hex(run.pose_hash)},
                  {"box_hash", hex(run.box_hash)}, {"box_hit_hash", hex(run.box_hit_hash)}};
      const bool is_cab = method.method.paper == PaperMethod::kCab;
      row["touching"] = is_cab ? Json(run.added.touching) : Json();
      row["added_by_padding"] = is_cab ? Json(run.added.by_padding) : Json();
      row["added_by_slack"] = is_cab ? Json(run.added.by_slack) : Json();
      Json figures = method_json(run, method);
      const Json convex = figures["convex"], paper = figures["paper"];
      for (const char* const nested : {"policies", "convex", "paper"}) figures.erase(nested);
      row.update(figures);
      const Json convex_keys = convex_json(method, {}), paper_keys = paper_json({});
      for (const auto& [key, unused] : convex_keys.items())
        row["convex_" + key] = convex.is_null() ? Json() : convex[key];
      for (const auto& [key, unused] : paper_keys.items()) row["paper_" + key] = paper.is_null() ? Json() : paper[key];
      rows.push_back(std::move(row));
    }
  write_csv(file, rows);
}

}  // namespace cab::perf
