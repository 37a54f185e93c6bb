#include "perf/measure/crowd/options.h"

#include <cab/cab.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "perf/base/option_values.h"
#include "scenes/crowd/crowd.h"
#include "scenes/crowd/detailed.h"
#include "scenes/scene_list.h"

namespace cab::perf {
namespace {

// The most frames of a run. They take hours.
constexpr std::uint32_t kMaxCrowdFrames = 1000000;

std::string crowd_scene_names(const char* separator) { return scenes::scene_names(scenes::kCrowdCommand, separator); }

std::string crowd_scene_help() {
  std::string help = "which crowd";
  for (const scenes::NamedScene& scene : scenes::scene_list())
    if (scene.is_for(scenes::kCrowdCommand)) help += std::string("\n  ") + scene.name + ": " + scene.meaning;
  return help;
}

std::string read_crowd_scene(const std::string& option, const std::string& text) {
  if (scenes::find_scene(scenes::kCrowdCommand, text) == nullptr)
    reject(option, text, "a crowd scene; choose " + crowd_scene_names(", "));
  return text;
}

std::string boxes_per_link_names(const char* separator) {
  std::vector<std::string> names;
  for (const std::uint32_t count : scenes::kBoxesPerLink) names.push_back(std::to_string(count));
  return joined(names, separator);
}

std::uint32_t read_boxes_per_link(const std::string& option, const std::string& text) {
  for (const std::uint32_t count : scenes::kBoxesPerLink)
    if (text == std::to_string(count)) return count;
  reject(option, text, "a number of boxes that a link can have; choose " + boxes_per_link_names(", "));
}

std::string rope_shape_names(const char* separator) {
  return joined({scenes::kRopeShapeNames.begin(), scenes::kRopeShapeNames.end()}, separator);
}

scenes::RopeShape read_rope_shape(const std::string& option, const std::string& text) {
  for (std::size_t i = 0; i < scenes::kRopeShapeNames.size(); ++i)
    if (text == scenes::kRopeShapeNames[i]) return static_cast<scenes::RopeShape>(i);
  reject(option, text, "a shape of ropes; choose " + rope_shape_names(", "));
}

constexpr const char* kAtRestNames[] = {"moved", "reported", "skipped"};  // in the order of AtRest

AtRest read_at_rest(const std::string& option, const std::string& text) {
  for (std::uint8_t i = 0; i < std::size(kAtRestNames); ++i)
    if (text == kAtRestNames[i]) return static_cast<AtRest>(i);
  reject(option, text, "what is done with those who rest; choose moved, reported, skipped");
}

scenes::LevelKind read_level_kind(const std::string& option, const std::string& text) {
  for (std::size_t i = 0; i < scenes::kLevelKindNames.size(); ++i)
    if (text == scenes::kLevelKindNames[i]) return static_cast<scenes::LevelKind>(i);
  reject(option, text, "what a level is made of; choose boxes, triangles");
}

// Adds the options that only some scenes have.
void add_options_of_scenes(CLI::App& command, CrowdOptions& o) {
  command
      .add_option_function<std::string>(
          "--area", [&o](const std::string& text) { o.area = read_positive("--area", text); },
          "uniform, rigs: square metres per character (default 1)")
      ->type_name("M2");
  command
      .add_option_function<std::string>(
          "--at-rest", [&o](const std::string& text) { o.at_rest = read_at_rest("--at-rest", text); },
          "city: how resting characters are handled: as moved, hits among them reported, or skipped (default skipped)")
      ->type_name("moved|reported|skipped");
  command
      .add_option_function<std::string>(
          "--boxes-per-link",
          [&o](const std::string& text) { o.boxes_per_link = read_boxes_per_link("--boxes-per-link", text); },
          "detailed: boxes per link (default 16)")
      ->type_name(boxes_per_link_names("|"));
  command
      .add_option_function<std::string>(
          "--level", [&o](const std::string& text) { o.level = read_level_kind("--level", text); },
          "level: what it is made of (default boxes)")
      ->type_name("boxes|triangles");
  command
      .add_option("--links", o.link_count,
                  "ropes: links per rope, 2 to 1024 (default 64); rigs: links per body, 16 to 1024 (default 100)")
      ->type_name("N")
      ->check(CLI::Range(scenes::kLeastRopeLinks, kMaxLinks).description(""));
  command
      .add_option_function<std::string>(
          "--shape", [&o](const std::string& text) { o.rope_shape = read_rope_shape("--shape", text); },
          "ropes: how they lie (default straight)")
      ->type_name(rope_shape_names("|"));
  command
      .add_option("--spacing", o.rope_spacing,
                  "ropes: the least distance of neighbours in thicknesses, .1 to 10; below 1 they touch (default 1.5)")
      ->type_name("X")
      ->check(CLI::Range(scenes::kLeastSpacing, scenes::kMostSpacing).description(""));
}

}  // namespace

Command add_crowd(CLI::App& app) {
  auto options = std::make_shared<CrowdOptions>();
  CrowdOptions& o = *options;
  CLI::App& command = *app.add_subcommand("crowd", "measure crowds: time, memory and counts per frame");
  command
      .add_option_function<std::string>(
          "--scene", [&o](const std::string& text) { o.scene = read_crowd_scene("--scene", text); }, crowd_scene_help())
      ->type_name(crowd_scene_names("|"))
      ->required();
  add_number(command, "--characters", o.character_count, "number of characters (default 10000)", 1, kMaxSharedCrowd);
  command.add_flag("--spatial-order", o.spatial_order,
                   "store the characters so that neighbours are near each other, in the order of the first frame");
  command.add_flag("--sweep", o.sweep, "find what may have touched since the frame before too (cab::sweep_margins)");
  command
      .add_option("--coarse", o.coarse.share,
                  "share of the characters, those farthest from the middle of their group, that are at a coarser level "
                  "of detail, 0 to 1 (default 0)")
      ->type_name("X")
      ->check(CLI::Range(0.0, 1.0).description(""));
  command
      .add_option_function<std::string>(
          "--lod", [&o](const std::string& text) { o.coarse.kind = read_lod_kind("--lod", text); },
          "what the leaves of that level are: boxes that hold what their links can reach, or nodes of the hierarchy "
          "(default reach)")
      ->type_name("reach|nodes");
  add_number(command, "--lod-leaves", o.coarse.leaves, "most leaves of a character at that level (default 1)", 1,
             kMaxLeaves);
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
  command
      .add_option_function<std::string>(
          "--fps", [&o](const std::string& text) { o.frames_per_second = read_positive("--fps", text); },
          "frames a second of trajectories that do not say it")
      ->type_name("N");
  add_options_of_scenes(command, o);
  add_policies(command, o.policies);
  command.add_flag("--in-contact", o.in_contact, "report which characters touch anything, instead of hits");
  command.add_flag("--profile", o.profile, "print where the time goes: the parts of each phase, and what causes them");
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
  for (const char* const option :
       {"--rounds", "--spatial-order", "--sweep", "--coarse", "--in-contact", "--at-rest", "--profile"})
    mpi->excludes(command.get_option(option));
  add_json(command, o.json_path, "write the table as JSON");
  add_csv(command, o.csv_path, "write the table as one line of CSV under a header");
  return {&command, [options] { return crowd_command(*options); }};
}

}  // namespace cab::perf
