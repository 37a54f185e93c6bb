// `cab sweep`: the cost and the benefit of every policy, on many scenes or on the user's files.
#include <algorithm>
#include <iostream>
#include <string>
#include <variant>
#include <vector>

#include "perf/base/report.h"
#include "perf/base/usage.h"
#include "perf/measure/sweep/cells.h"
#include "perf/measure/sweep/options.h"
#include "perf/measure/sweep/output.h"
#include "perf/measure/sweep/scenes.h"
#include "perf/tools/run/run_world.h"
#include "scenes/import/companions.h"
#include "scenes/scene_list.h"

namespace cab::perf {
namespace {

// The scenes that the options name, or the default ones; none beside files.
std::vector<std::string> choose_scenes(const SweepOptions& options) {
  std::vector<std::string> chosen = options.scenes;
  if (!chosen.empty() || !options.world.files.empty()) return chosen;
  for (const scenes::NamedScene& scene : scenes::scene_list())
    if (scene.is_for(scenes::kSweepByDefault)) chosen.push_back(scene.name);
  return chosen;
}

bool is_sized(const std::string& scene) {
  return std::holds_alternative<scenes::SizedCrowdScene>(scenes::find_scene(scenes::kSweepCommand, scene)->source);
}

// Throws UsageError for options that contradict each other, or policies that no cell can have.
void check(const SweepOptions& options, const std::vector<Policies>& policies) {
  check_files(options.world);
  if (options.world.skin && options.world.skin->surface)
    throw UsageError("--body surface: a sweep judges hits by exact tests of solids; choose --body skin");
  if (std::any_of(policies.begin(), policies.end(), [](const Policies& p) { return p.exact == Exact::kSurface; }))
    throw UsageError("--exact surface: a sweep is of solids, without triangles to test; choose none, convex or fcl");
  if (!options.world.files.empty() && !options.scenes.empty())
    throw UsageError("--scene and FILE...: give one of the two; the files are a scene of their own");
  if (options.character_count > 0 && !options.world.files.empty())
    throw UsageError("--characters is not for FILE..., which have characters of their own");
  const std::vector<std::string> chosen = choose_scenes(options);
  if (options.character_count > 0 && std::none_of(chosen.begin(), chosen.end(), is_sized))
    throw UsageError("--characters is for the detailed scenes and the ropes; choose one of them by --scene");
  check_outputs({{"--csv", options.csv_path}, {"--json", options.json_path}}, input_paths(options.world),
                [&options](const std::string& file) { return scenes::companion_files(file, options.world.sandbox); });
}

}  // namespace

int sweep_command(const SweepOptions& options) {
  const std::vector<Policies> policies = choose_policies(options.values);
  check(options, policies);
  OutputFile json(options.json_path), csv(options.csv_path);
  const SweepPlan plan = {policies, options.isas, options.thread_counts, options.rounds};
  std::cout
      << "Times are medians over rounds; each round keeps the fastest of several runs. Those of phases are summed over "
         "threads.\nfalse: leaf pairs whose boxes overlap and whose shapes are apart; misses: true hits that are lost. "
         "The judge is convex; where cells are by convex, fcl.\n*: no other of the same isa, threads "
         "and exact is as fast with as few false positives.\n=: the same work as a cell with another strategy, whose "
         "times it has.\n\n";
  std::vector<SweepRun> runs;
  std::uint64_t misses = 0;
  const auto run = [&](const SweepScene& scene) {
    runs.push_back(run_sweep(scene, plan));
    print_sweep(runs.back());
    for (const SweepCell& cell : runs.back().cells) misses += cell.misses;
  };
  if (!options.world.files.empty()) {
    const SweepScene scene = make_files_scene(options.world);
    for (const std::string& note : scene.scene->notes) tell("note", note);
    run(scene);
  }
  for (const std::string& name : choose_scenes(options)) run(make_sweep_scene(name, options.character_count));
  write_sweep_json(json, runs);
  write_sweep_csv(csv, runs);

  if (misses > 0) std::cerr << "cab sweep: " << misses << " true hits were missed\n";
  return misses > 0 ? 1 : 0;
}

}  // namespace cab::perf
