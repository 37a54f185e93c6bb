#include "perf/measure/crowd/options.h"

#include <cab/cab.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "scenes/crowd/crowd.h"
#include "scenes/crowd/detailed.h"
#include "scenes/scene_list.h"

namespace cab::perf {
namespace {

// The most frames of a run. They take hours.
constexpr std::uint32_t kMaxCrowdFrames = 1000000;

std::string crowd_scene_help() {
  std::string help = "which crowd";
  for (const scenes::NamedScene& scene : scenes::scene_list())
    if (scene.is_for(scenes::kCrowdCommand)) help += std::string("\n  ") + scene.name + ": " + scene.meaning;
  return help;
}

std::string read_crowd_scene(const std::string& option, const std::string& text) {
  if (scenes::find_scene(scenes::kCrowdCommand, text) == nullptr)
    reject(option, text, "a crowd scene; choose " + scenes::scene_names(scenes::kCrowdCommand, ", "));
  return text;
}

constexpr const char* kAtRestNames[] = {"moved", "reported", "skipped"};  // in the order of AtRest

// Adds the options that only some scenes have.
void add_options_of_scenes(CLI::App& command, CrowdOptions& o) {
  add_read(command, "--area", "M2", o.area, "uniform, rigs: square metres per character (default 1)", read_positive);
  add_choice<AtRest>(
      command, "--at-rest", kAtRestNames, o.at_rest, "what is done with those who rest",
      "city: how resting characters are handled: as moved, hits among them reported, or skipped (default skipped)");
  std::vector<std::string> counts;
  for (const std::uint32_t count : scenes::kBoxesPerLink) counts.push_back(std::to_string(count));
  add_read(command, "--boxes-per-link", joined(counts, "|"), o.boxes_per_link, "detailed: boxes per link (default 16)",
           [counts](const std::string& option, const std::string& text) {
             return scenes::kBoxesPerLink[read_choice(option, text, counts, "a number of boxes that a link can have")];
           });
  add_choice<scenes::LevelKind>(command, "--level", scenes::kLevelKindNames, o.level, "what a level is made of",
                                "level: what it is made of (default boxes)");
  add_number(command, "--links", o.link_count,
             "ropes: links per rope, 2 to 1024 (default 64); rigs: links per body, 16 to 1024 (default 100)",
             scenes::kLeastRopeLinks, kMaxLinks);
  add_choice<scenes::RopeShape>(command, "--shape", scenes::kRopeShapeNames, o.rope_shape, "a shape of ropes",
                                "ropes: how they lie (default straight)");
  add_choice<scenes::SkinLeafKind>(command, "--skin-leaves", scenes::kSkinLeafKindNames, o.skin_leaves,
                                   "a kind of leaves of skins",
                                   "skins: boxes that grow with the poses of links, or on one link (default grown)");
  add_within(command, "--spacing", "X", o.rope_spacing,
             "ropes: the least distance of neighbours in thicknesses, .1 to 10; below 1 they touch (default 1.5)",
             scenes::kLeastSpacing, scenes::kMostSpacing);
}

}  // namespace

Command add_crowd(CLI::App& app) {
  auto options = std::make_shared<CrowdOptions>();
  CrowdOptions& o = *options;
  CLI::App& command = *app.add_subcommand("crowd", "measure crowds: time, memory and counts per frame");
  add_read(command, "--scene", scenes::scene_names(scenes::kCrowdCommand, "|"), o.scene, crowd_scene_help(),
           read_crowd_scene)
      ->required();
  add_number(command, "--characters", o.character_count, "number of characters (default 10000)", 1, kMaxSharedCrowd);
  command.add_flag("--spatial-order", o.spatial_order,
                   "store the characters so that neighbours are near each other, in the order of the first frame");
  command.add_flag("--sweep", o.sweep, "find what may have touched since the frame before too (cab::sweep_margins)");
  CLI::Option* const coarse = add_within(
      command, "--coarse", "X", o.coarse.share,
      "share of the characters, those farthest from the middle of their group, that are at a coarser level of "
      "detail, 0 to 1 (default 0)",
      0, 1);
  add_choice<LodKind>(command, "--lod", kLodKindNames, o.coarse.kind, "a kind of levels of detail",
                      "what the leaves of that level are: boxes that hold what their links can reach, or nodes of the "
                      "hierarchy (default reach)")
      ->needs(coarse);
  add_number(command, "--lod-leaves", o.coarse.leaves, "most leaves of a character at that level (default 1)", 1,
             kMaxLeaves)
      ->needs(coarse);
  add_number(command, "--frames", o.frame_count, "different frames per round, 1/30 s apart (default 8)", 1,
             kMaxCrowdFrames);
  add_rounds(command, o.rounds, "rounds after one to warm up; times are their medians (default 7)");
  CLI::Option* clips =
      command.add_option("--clip", o.clips, "motion file that characters play; give it again for more")
          ->type_name("FILE")
          ->allow_extra_args(false);
  refuse_empty(*clips);
  add_units(command, "clip", o.metres_per_unit);
  add_up(command, o.up, "axis that points up in the clips; without it the axis along which each figure is tallest");
  add_no_sandbox(command, o.sandbox);
  add_path(command, "--trajectories", o.trajectories_path,
           "where people walk, one person in one frame per line; a header names the columns id, frame, x and y, and a"
           " comment `# framerate: N fps` the rate; without a header they are id frame x y, or eight columns of an"
           " obsmat")
      ->type_name("FILE");
  add_read(command, "--fps", "N", o.frames_per_second, "frames a second of trajectories that do not say it",
           read_positive);
  add_options_of_scenes(command, o);
  add_policies(command, o.policies);
  command.add_flag("--in-contact", o.in_contact, "report which characters touch anything, instead of hits");
  add_isa(command, o.isa);
  add_threads(command, o.thread_count);
  CLI::Option* mpi = command.add_flag("--mpi", o.mpi, "share the crowd between the ranks of `mpirun -n RANKS cab ...`");
  add_path(command, "--out", o.out_folder,
           "--mpi: a folder for the hits of all ranks; a run that was cut off continues from its last checkpoint there")
      ->type_name("DIR")
      ->needs(mpi);
  add_number(command, "--checkpoint", o.checkpoint,
             "--mpi: frames after which hits are safe on disk, and the crowd is cut anew (default 32)", 1,
             kMaxCrowdFrames)
      ->needs(mpi);
  for (const char* const option : {"--rounds", "--spatial-order", "--sweep", "--coarse", "--in-contact", "--at-rest"})
    mpi->excludes(command.get_option(option));
  add_json(command, o.json_path, "write the table as JSON");
  add_csv(command, o.csv_path, "write the table as one line of CSV under a header");
  return {&command, [options] { return crowd_command(*options); }};
}

}  // namespace cab::perf
