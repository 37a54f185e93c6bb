// `cab continuity`: how far inner boxes jump if a pose moves a little, for every refit and every value of `extents`.
#include "perf/base/option_values.h"
#include "perf/base/report.h"
#include "perf/base/usage.h"
#include "perf/continuity/options.h"
#include "perf/continuity/sweep.h"

#include <cab/cab.h>

#include <iostream>
#include <nlohmann/json.hpp>

namespace cab::perf {
namespace {

using Json = nlohmann::ordered_json;

// Every refit with every value of `extents`.
std::vector<Policies> all_refits() {
  std::vector<Policies> out(1);
  for (std::uint32_t field = 0; field < policy_table().size; ++field) {
    const PolicyField& row = policy_table()[field];
    if (row.name != std::string("refit") && row.name != std::string("extents")) continue;
    std::vector<Policies> longer;
    for (Policies policies : out)
      for (std::uint32_t value = 0; value < row.value_count; ++value) {
        policy_set(policies, field, row.values[value].name);
        longer.push_back(policies);
      }
    out = longer;
  }
  return out;
}

// One printed number of a row, in the order of the columns.
struct Figure {
  const char* name;
  double value;
};

std::vector<Figure> figures_of(const Continuity& seen) {
  return {{"jump", seen.jump},
          {"jump_motion", seen.jump_motion},
          {"closer_jump", seen.closer_jump},
          {"closer_motion", seen.closer_motion},
          {"ratio", seen.ratio},
          {"volume_change", seen.volume_change},
          {"area_change", seen.area_change}};
}

std::string percent(double part, int decimals) { return fixed(100 * part, decimals); }

void print_case(const SweepCase& figure, const std::vector<Policies>& policies, const std::vector<Continuity>& seen) {
  std::cout << figure.name << ": " << figure.meaning << '\n';
  TextTable table;
  table.add_row({"refit, extents", "jump %", "motion %", "closer: jump %", "motion %", "jump / motion", "volume %",
                 "area %", "steps > 1 %"});
  for (std::size_t p = 0; p < policies.size(); ++p) {
    const Continuity& s = seen[p];
    table.add_row({policy_value(policies[p], "refit") + ", " + policy_value(policies[p], "extents"), percent(s.jump, 3),
                   percent(s.jump_motion, 4), percent(s.closer_jump, 3), percent(s.closer_motion, 5), fixed(s.ratio, 2),
                   percent(s.volume_change, 2), percent(s.area_change, 2), std::to_string(s.steps_above)});
  }
  table.print(std::cout);
  std::cout << std::endl;
}

}  // namespace

int continuity_command(const ContinuityOptions& options) {
  check_outputs({{"--csv", options.csv_path}, {"--json", options.json_path}}, {});
  OutputFile json_file(options.json_path), csv_file(options.csv_path);
  const std::vector<SweepCase> figures = sweep_cases();
  const std::vector<Policies> policies = all_refits();
  std::vector<std::vector<Continuity>> seen;
  {
    ProgressBar bar("figures", figures.size());
    for (const SweepCase& figure : figures) {
      seen.push_back(measure_continuity(figure, policies, options.step_count, options.isa));
      bar.advance(1);
    }
  }
  std::cout
      << "Inner boxes in " << options.step_count << " steps of each figure. jump: how far a box moved in its worst "
      << "step, in % of its size;\nmotion: how far a leaf did, in % of the same; closer: after that step was halved "
      << kHalvings << " times.\n\n";
  for (std::size_t f = 0; f < figures.size(); ++f) print_case(figures[f], policies, seen[f]);

  Json json;
  json["cab_version"] = CAB_VERSION_STRING;
  json["steps"] = options.step_count;
  json["halvings"] = kHalvings;
  json["rows"] = Json::array();
  std::string csv = "figure,refit,extents,steps";
  for (const Figure& column : figures_of({})) csv += std::string(",") + column.name;
  csv += ",steps_above_1_percent\n";
  for (std::size_t f = 0; f < figures.size(); ++f)
    for (std::size_t p = 0; p < policies.size(); ++p) {
      const std::string refit = policy_value(policies[p], "refit"), extents = policy_value(policies[p], "extents");
      Json row = {{"figure", figures[f].name}, {"refit", refit}, {"extents", extents}};
      csv += csv_field(figures[f].name) + ',' + refit + ',' + extents + ',' + std::to_string(options.step_count);
      for (const Figure& column : figures_of(seen[f][p])) {
        row[column.name] = column.value;
        csv += ',' + shortest(column.value);
      }
      row["steps_above_1_percent"] = seen[f][p].steps_above;
      csv += ',' + std::to_string(seen[f][p].steps_above) + '\n';
      json["rows"].push_back(row);
    }
  write_json(json_file, json);
  if (csv_file) {
    csv_file.stream() << csv;
    csv_file.close();
  }
  return 0;
}

}  // namespace cab::perf
