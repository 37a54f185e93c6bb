#include "perf/measure/sweep/options.h"

#include <cab/cab.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>

#include "perf/base/usage.h"
#include "perf/measure/sweep/scenes.h"
#include "perf/tools/run/options.h"
#include "scenes/scene_list.h"

namespace cab::perf {
namespace {

std::vector<std::string> read_sweep_scenes(const std::string& option, const std::string& text) {
  const std::vector<std::string> names = split_commas(text);
  for (const std::string& name : names)
    if (scenes::find_scene(scenes::kSweepCommand, name) == nullptr || std::count(names.begin(), names.end(), name) > 1)
      reject(option, text,
             "a list of different scenes; choose from " + scenes::scene_names(scenes::kSweepCommand, ", "));
  return names;
}

std::string sweep_scene_help() {
  std::string help = "scenes, separated by commas (default: those with *)";
  for (const scenes::NamedScene& scene : scenes::scene_list())
    if (scene.is_for(scenes::kSweepCommand))
      help +=
          std::string("\n  ") + scene.name + (scene.is_for(scenes::kSweepByDefault) ? "*" : "") + ": " + scene.meaning;
  return help;
}

std::vector<std::uint32_t> read_thread_counts(const std::string& option, const std::string& text) {
  const std::vector<std::uint32_t> counts = read_number_list(option, text);
  for (const std::uint32_t count : counts)
    if (count > kMaxThreads)
      throw UsageError(option + ": " + std::to_string(count) + " is not within 0 to " + std::to_string(kMaxThreads));
  return counts;
}

}  // namespace

Command add_sweep(CLI::App& app) {
  auto options = std::make_shared<SweepOptions>();
  SweepOptions& o = *options;
  CLI::App& command =
      *app.add_subcommand("sweep", "measure what every policy costs and gains, on many scenes or on your own files");
  add_world(command, o.world, "motion files, one character each; without them the scenes below");
  const std::vector<const CLI::Option*> of_files = own_options(command);
  add_read(command, "--scene", "LIST", o.scenes, sweep_scene_help(), read_sweep_scenes);
  add_number(command, "--characters", o.character_count,
             "characters of the detailed scenes and of the ropes (default 100 and 16)", 1, kMaxCrowd);
  o.values.resize(policy_table().size);
  for (std::uint32_t field = 0; field < policy_table().size; ++field)
    add_text(command, std::string("--") + policy_table()[field].name, "LIST", policy_list_help(field),
             [&o, field](const std::string& text) { o.values[field] = read_policy_values(field, text); });
  add_isas(command, o.isas, "auto");
  add_read(command, "--threads", "LIST", o.thread_counts,
           "numbers of threads, separated by commas (default 1); 0: every core", read_thread_counts);
  add_rounds(command, o.rounds,
             "rounds, in each of which every cell has one turn; times are their medians (default 7)");
  add_json(command, o.json_path, "write one row per cell as JSON");
  add_csv(command, o.csv_path, "write one row per cell as CSV");
  return {&command, [options, of_files] {
            for (const CLI::Option* option : of_files)
              if (option->count() > 0 && options->world.files.empty())
                throw UsageError(option->get_name() + " is for FILE...; give at least one file");
            return sweep_command(*options);
          }};
}

}  // namespace cab::perf
