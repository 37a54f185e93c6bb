#include "perf/tools/query/options.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <limits>
#include <memory>

#include "perf/base/usage.h"
#include "perf/tools/run/options.h"
#include "scenes/scene_list.h"

namespace cab::perf {
namespace {

constexpr std::uint32_t kDefaultRandom = 10000;

// The crowd scenes whose characters need no files.
std::vector<std::string> own_scenes() {
  std::vector<std::string> names;
  for (const scenes::NamedScene& scene : scenes::scene_list()) {
    if (!scene.is_for(scenes::kCrowdCommand)) continue;
    const scenes::CrowdScene& crowd = scenes::crowd_scene(scene.name);
    if (crowd.clips != scenes::ClipUse::kNeeded && !crowd.needs_trajectories) names.emplace_back(scene.name);
  }
  return names;
}

std::string read_scene(const std::string& option, const std::string& text) {
  read_choice(option, text, own_scenes(), "a crowd scene that needs no clips");
  return text;
}

Exact read_exact(const std::string& option, const std::string& text) {
  return read_choice(option, text, {"none", "convex"}, "what decides") == 0 ? Exact::kNone : Exact::kConvex;
}

// Adds --rays, --spheres, --boxes, --capsules and --points.
std::vector<CLI::Option*> add_query_files(CLI::App& command, QueryOptions& o) {
  constexpr std::array<const char*, kFileKindCount> kMeanings = {
      "links that rays meet, or spheres of a radius that move along them", "links that spheres overlap",
      "links that oriented boxes overlap", "links that capsules overlap, whose segments lie along their z",
      "links within a distance of points, nearest first"};
  std::vector<CLI::Option*> added;
  for (std::size_t k = 0; k < kFileKindCount; ++k) {
    CLI::Option* option =
        command.add_option(std::string("--") + kind_name(kFileKinds[k]), o.paths[k],
                           std::string(kMeanings[k]) + "; columns: " + column_names(kFileKinds[k]) +
                               (k == 0 ? "\n  a CSV file whose first line names the columns, in any order; those in"
                                         " brackets may be left out; lengths in metres; length and distance may be"
                                         " inf; give the option again for more files"
                                       : ""));
    option->type_name("FILE.csv")->allow_extra_args(false);
    refuse_empty(*option);
    added.push_back(option);
  }
  return added;
}

// Adds FILE... with its options, and --scene with its own. Returns the options of files.
std::vector<const CLI::Option*> add_targets(CLI::App& command, QueryOptions& o) {
  add_world(command, o.world, "motion files, one character each");
  const std::vector<const CLI::Option*> of_files = own_options(command);
  CLI::Option* scene = add_read(command, "--scene", joined(own_scenes(), "|"), o.scene,
                                "instead of files: a scene of `cab crowd`", read_scene);
  add_number(command, "--characters", o.character_count, "of --scene: number of characters (default 10000)", 1,
             kMaxCrowd)
      ->needs(scene);
  return of_files;
}

// Adds --frame and --frames.
void add_frames(CLI::App& command, QueryOptions& o) {
  CLI::Option* frame =
      add_read(command, "--frame", "K|last", o.frame,
               "frame whose poses are asked, counted from 0 (default 0); 1/30 s apart in a scene, which has no last",
               read_frame);
  command
      .add_option_function<std::vector<std::string>>(
          "--frames",
          [&o](const std::vector<std::string>& texts) {
            o.all_frames = texts.empty() || texts[0].empty();
            if (!o.all_frames) o.frames = read_frame_range("--frames", texts[0]);
          },
          "all frames, the first N, or frames A to B - 1: every query is asked in each")
      ->type_name("[N|A:B]")
      ->expected(0, 1)
      ->excludes(frame);
}

}  // namespace

Command add_query(CLI::App& app) {
  auto options = std::make_shared<QueryOptions>();
  QueryOptions& o = *options;
  CLI::App& command = *app.add_subcommand("query", "answer ray casts, shape overlaps and nearest-point queries");
  const std::vector<const CLI::Option*> of_files = add_targets(command, o);
  add_frames(command, o);
  const std::vector<CLI::Option*> files = add_query_files(command, o);
  CLI::Option* random = add_number(
      command, "--random", o.random_count,
      "without files of queries: rays through random points of the targets' boxes (default 10000)", 1, kMaxQueries);
  for (CLI::Option* file : files) random->excludes(file);
  add_number(command, "--seed", o.seed, "seed of random rays (default 1)", 0,
             std::numeric_limits<std::uint32_t>::max());
  add_read(command, "--exact", "none|convex", o.exact,
           "what links are: their leaf boxes, or their convex shapes (default none)", read_exact);
  add_choice<QueryWant>(command, "--want", kWantNames, o.want, "what a query asks for",
                        "whether there is any link, the closest, or all of them (default closest)");
  add_number(command, "--max-hits", o.max_hits, "of --want all: the most hits of a query, the closest", 1,
             std::numeric_limits<std::uint32_t>::max());
  command.add_flag("--depth", o.with_depth, "how deep links are in spheres, boxes and capsules, the deepest first");
  add_isa(command, o.isa);
  add_threads(command, o.thread_count);
  add_rounds(command, o.rounds, "rounds after one to warm up; times are their medians (default 3)");
  add_path(command, "--out", o.out_path, "write every hit as CSV")->type_name("OUT.csv");
  add_json(command, o.json_path, "write the table as JSON");
  const CLI::Option* max_hits = command.get_option("--max-hits");
  return {&command, [options, of_files, files, max_hits] {
            for (const CLI::Option* option : of_files)
              if (option->count() > 0 && !options->scene.empty())
                throw UsageError(option->get_name() + " is not for --scene " + options->scene +
                                 ", whose characters are its own");
            if (max_hits->count() > 0 && options->want != QueryWant::kAll)
              throw UsageError("--max-hits is for --want all");
            const bool has_files =
                std::any_of(files.begin(), files.end(), [](const CLI::Option* file) { return file->count() > 0; });
            if (!has_files && options->random_count == 0) options->random_count = kDefaultRandom;
            return query_command(*options);
          }};
}

}  // namespace cab::perf
