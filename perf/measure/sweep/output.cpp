#include "perf/measure/sweep/output.h"

#include <cab/version.h>
#include <algorithm>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>
#include <tuple>

#include "perf/base/option_values.h"
#include "perf/base/report.h"

namespace cab::perf {
namespace {

using Json = nlohmann::ordered_json;

// The name of a value in code: "cab_sum" is CabSum.
std::string in_code(const std::string& name) {
  std::string out;
  bool upper = true;
  for (const char c : name) {
    if (c != '_') out += upper && c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
    upper = c == '_';
  }
  return out;
}

// Seconds per frame, over the rounds.
Spread phase_spread(const SweepRun& run, const SweepCell& cell, double FrameStats::*seconds) {
  std::vector<double> values;
  for (const FrameStats& round : cell.rounds) values.push_back(round.*seconds / run.frame_count);
  return spread_of(values);
}

std::vector<const SweepCell*> fastest_first(const SweepRun& run) {
  std::vector<const SweepCell*> cells;
  for (const SweepCell& cell : run.cells) cells.push_back(&cell);
  std::stable_sort(cells.begin(), cells.end(), [](const SweepCell* a, const SweepCell* b) {
    const auto key = [](const SweepCell* c) {
      return std::tuple(c->isa, c->thread_count, c->policies.exact, c->total_seconds());
    };
    return key(a) < key(b);
  });
  return cells;
}

std::string percent_less(double ratio) { return fixed(100 * (1 - ratio), 0) + " %"; }

// Prints how much time a cell saves over another, and the code that sets its policies.
void print_gain(const SweepCell& of, const SweepCell& cell, const std::string& name_of) {
  const Spread ratio = time_ratio(of, cell);
  std::cout << short_name(cell.policies) << " takes " << percent_less(ratio.median) << " less time than " << name_of
            << " (" << percent_less(ratio.most) << " to " << percent_less(ratio.least)
            << " in the rounds) and misses nothing; false positives " << cell.false_positives << " for "
            << of.false_positives << ":\n  " << code_line(cell.policies) << '\n';
}

// Prints what to set instead of the defaults, which are the policies of cells[of].
void print_advice(const SweepRun& run, std::size_t of) {
  const SweepCell& defaults = run.cells[of];
  std::cout << to_string(defaults.isa) << ", threads " << defaults.thread_count << ", exact "
            << policy_value(defaults.policies, "exact") << ": ";
  const std::optional<std::size_t> better = better_cell(run.cells, of, defaults.false_positives);
  if (better) {
    print_gain(defaults, run.cells[*better], "the defaults");
  } else {
    std::cout << "keep the defaults; nothing without more false positives is clearly faster:\n  "
              << code_line(defaults.policies) << '\n';
  }
  const std::size_t chosen = better.value_or(of);
  if (const auto faster = better_cell(run.cells, chosen, UINT64_MAX)) {
    std::cout << "  with more false positives, ";
    print_gain(run.cells[chosen], run.cells[*faster], better ? "that" : "the defaults");
  }
}

Json cell_json(const SweepRun& run, const SweepCell& cell) {
  Json json;
  json["scene"] = run.scene;
  json["characters"] = run.character_count;
  json["leaves"] = run.most_leaves;
  json["frames"] = run.frame_count;
  json.update(policies_json(cell.policies));
  json["isa"] = to_string(cell.isa);
  json["threads"] = cell.thread_count;
  json["rounds"] = cell.rounds.size();
  for (const Phase& phase : kPhases)
    add_spread(json, std::string(phase.key) + "_seconds", phase_spread(run, cell, phase.seconds));
  add_spread(json, "total_seconds", phase_spread(run, cell, &FrameStats::seconds_total));
  json["box_tests"] = cell.counts.box_tests;
  json["leaf_pairs"] = cell.counts.leaf_pairs;
  json["hits"] = cell.hits;
  json["true_hits"] = run.true_hits;
  json["false_positives"] = cell.false_positives;
  json["misses"] = cell.misses;
  json["hits_hash"] = hex(cell.hits_hash);
  Policies named;
  named.strategy = cell.same_work_as.value_or(named.strategy);
  json["same_work_as"] = cell.same_work_as ? Json(policy_value(named, "strategy")) : Json();
  json["on_front"] = cell.on_front;
  return json;
}

}  // namespace

std::string short_name(const Policies& policies) {
  const std::uint32_t strategy = policy_row("strategy");
  std::string name = policy_value(policies, strategy);
  for (std::uint32_t row = 0; row < policy_table().size; ++row)
    if (row != strategy && row != policy_row("exact") && policy_get(policies, row) != policy_get(Policies(), row))
      name += std::string(" ") + policy_value(policies, row);
  return name;
}

std::string code_line(const Policies& policies) {
  std::string line;
  for (std::uint32_t row = 0; row < policy_table().size; ++row) {
    const std::string field = policy_table()[row].name;
    line += (row > 0 ? " " : "") + std::string("policies.") + field + " = cab::" + in_code(field) + "::k" +
            in_code(policy_value(policies, row)) + ";";
  }
  return line;
}

void print_sweep(const SweepRun& run) {
  std::cout << run.scene << ": " << run.character_count << " characters of up to " << run.most_leaves << " boxes, "
            << run.frame_count << " frames, " << run.true_hits << " true hits (judge: " << run.judge << ")\n";
  TextTable text;
  std::vector<std::string> header = {"front"};
  for (const PolicyField& field : policy_table()) header.emplace_back(field.name);
  for (const char* name : {"isa", "threads", "us per frame", "least", "most"}) header.emplace_back(name);
  for (const Phase& phase : kPhases) header.emplace_back(phase.key);
  for (const char* name : {"box tests", "leaf pairs", "hits", "false", "misses", "hash of hits"})
    header.emplace_back(name);
  text.add_row(header);
  for (const SweepCell* cell : fastest_first(run)) {
    std::vector<std::string> row = {cell->on_front ? "*" : cell->same_work_as ? "=" : ""};
    for (std::uint32_t field = 0; field < policy_table().size; ++field)
      row.emplace_back(policy_value(cell->policies, field));
    row.emplace_back(to_string(cell->isa));
    row.push_back(std::to_string(cell->thread_count));
    const Spread total = phase_spread(run, *cell, &FrameStats::seconds_total);
    for (const double seconds : {total.median, total.least, total.most}) row.push_back(fixed(1e6 * seconds, 2));
    for (const Phase& phase : kPhases) row.push_back(fixed(1e6 * phase_spread(run, *cell, phase.seconds).median, 2));
    for (const std::uint64_t count :
         {cell->counts.box_tests, cell->counts.leaf_pairs, cell->hits, cell->false_positives, cell->misses})
      row.push_back(std::to_string(count));
    row.push_back(hex(cell->hits_hash));
    text.add_row(row);
  }
  text.print(std::cout);
  for (std::size_t c = 0; c < run.cells.size(); ++c) {
    Policies defaults;
    defaults.exact = run.cells[c].policies.exact;
    if (code_line(run.cells[c].policies) == code_line(defaults)) print_advice(run, c);
  }
  std::cout << std::endl;
}

void write_sweep_json(OutputFile& file, const std::vector<SweepRun>& runs) {
  Json json;
  json["cab_version"] = CAB_VERSION_STRING;
  json["scenes"] = Json::array();
  for (const SweepRun& run : runs) {
    Json scene;
    scene["scene"] = run.scene;
    scene["characters"] = run.character_count;
    scene["leaves"] = run.most_leaves;
    scene["frames"] = run.frame_count;
    scene["true_hits"] = run.true_hits;
    scene["judge"] = run.judge;
    scene["cells"] = Json::array();
    for (const SweepCell& cell : run.cells) scene["cells"].push_back(cell_json(run, cell));
    json["scenes"].push_back(scene);
  }
  write_json(file, json);
}

void write_sweep_csv(OutputFile& file, const std::vector<SweepRun>& runs) {
  std::vector<Json> rows;
  for (const SweepRun& run : runs)
    for (const SweepCell& cell : run.cells) rows.push_back(cell_json(run, cell));
  write_csv(file, rows);
}

}  // namespace cab::perf
