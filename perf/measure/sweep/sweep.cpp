// `cab sweep`: the cost and the benefit of every policy, on many scenes or on the user's files.
#include <algorithm>
#include <iostream>
#include <string>
#include <vector>

#include "perf/base/report.h"
#include "perf/base/usage.h"
#include "perf/measure/sweep/cells.h"
#include "perf/measure/sweep/lods.h"
#include "perf/measure/sweep/options.h"
#include "perf/measure/sweep/output.h"
#include "perf/measure/sweep/plot.h"
#include "perf/measure/sweep/scenes.h"
#include "perf/tools/run/run_world.h"
#include "scenes/import/printable.h"
#include "scenes/scene_list.h"

namespace cab::perf {
namespace {

// Throws UsageError for options that contradict each other.
void check(const SweepOptions& options) {
  check_files(options.world);
  const bool about_files = !options.world.offsets.empty() || !options.world.metres_per_unit.empty() ||
                           options.world.up != 0 || options.world.frames_per_second != 0 ||
                           !options.world.motion_paths.empty();
  if (options.world.files.empty() && about_files)
    throw UsageError("--offset, --units, --up, --fps and --motion are for FILE...; give at least one file");
  if (!options.world.files.empty() && !options.scenes.empty())
    throw UsageError("--scene and FILE...: give one of the two; the files are a scene of their own");
  check_outputs({{"--csv", options.csv_path}, {"--json", options.json_path}}, input_paths(options.world));
}

// A scene, and whether all policies run on it, or only the strategies.
struct ChosenScene {
  std::string name;
  bool all_policies;
};

// The scenes that the options name, or the default ones. If pictures are drawn, all scenes that differ only in size
// follow the default ones.
std::vector<ChosenScene> choose_scenes(const SweepOptions& options) {
  std::vector<ChosenScene> chosen;
  for (const std::string& name : options.scenes) chosen.push_back({name, true});
  if (!chosen.empty()) return chosen;
  for (const scenes::NamedScene& scene : scenes::scene_list())
    if (scene.is_for(scenes::kSweepByDefault)) chosen.push_back({scene.name, true});
  if (options.plot_folder.empty()) return chosen;
  for (const char* family : {"uniform", "detailed", "ropes"})
    for (const SweepMember& member : sweep_family(family))
      if (std::none_of(chosen.begin(), chosen.end(), [&](const ChosenScene& c) { return c.name == member.name; }))
        chosen.push_back({member.name, false});
  return chosen;
}

// The policies that differ from the defaults only in strategy and exact test.
std::vector<Policies> strategies_alone(const std::vector<Policies>& all) {
  std::vector<Policies> out;
  for (const Policies& policies : all) {
    Policies same;
    same.strategy = policies.strategy;
    same.exact = policies.exact;
    if (code_line(same) == code_line(policies)) out.push_back(policies);
  }
  return out;
}

}  // namespace

int sweep_command(const SweepOptions& options) {
  check(options);
  OutputFile json(options.json_path), csv(options.csv_path);
  if (!options.plot_folder.empty()) prepare_plots(options.plot_folder);
  const SweepPlan plan = {choose_policies(options.values), options.isas, options.thread_counts, options.rounds};
  SweepPlan strategies = plan;
  strategies.policies = strategies_alone(plan.policies);
  std::cout
      << "Times are medians over rounds; each round keeps the fastest of several runs. Those of phases are summed over "
         "threads.\nfalse: leaf pairs whose boxes overlap and whose shapes are apart; misses: true hits that are lost. "
         "The judge is convex; where cells are by convex, fcl.\narea: of all inner boxes in some poses, relative to "
         "that of refit covariance and to the least that turning each box finds.\n*: no other of the same isa, threads "
         "and exact is as fast with as few false positives.\n=: the same work as a cell with another strategy, whose "
         "times it has.\n\n";
  std::vector<SweepRun> runs;
  std::uint64_t misses = 0;
  const auto run = [&](const SweepScene& scene, bool all_policies) {
    runs.push_back(run_sweep(scene, all_policies ? plan : strategies));
    print_sweep(runs.back());
    if (!options.lods || !scene.crowd) return;
    const std::vector<LodRow> rows = sweep_lods(scene, options.rounds);
    print_lods(scene, rows);
    for (const LodRow& row : rows) misses += row.misses;
  };
  if (!options.world.files.empty()) {
    const SweepScene scene = make_files_scene(options.world);
    for (const std::string& note : scene.scene->notes) tell("note", note);
    run(scene, true);
  } else {
    for (const ChosenScene& chosen : choose_scenes(options))
      run(make_sweep_scene(chosen.name, options.character_count), chosen.all_policies);
  }
  write_sweep_json(json, runs);
  write_sweep_csv(csv, runs);
  if (!options.plot_folder.empty()) {
    std::cout << "pictures in " << scenes::printable(options.plot_folder) << ':';
    for (const std::string& name : plot_sweep(options.plot_folder, runs)) std::cout << ' ' << name;
    std::cout << '\n';
  }

  for (const SweepRun& done : runs)
    for (const SweepCell& cell : done.cells) misses += cell.misses;
  if (misses > 0) std::cerr << "cab sweep: " << misses << " true hits were missed\n";
  return misses > 0 ? 1 : 0;
}

}  // namespace cab::perf
