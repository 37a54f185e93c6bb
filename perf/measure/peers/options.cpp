#include "perf/measure/peers/options.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <limits>
#include <memory>

#include "perf/base/option_values.h"
#include "scenes/import/limits.h"
#include "scenes/scene_list.h"

namespace cab::perf {
namespace {

std::vector<Leaves> read_leaves(const std::string& option, const std::string& text) {
  std::vector<Leaves> out;
  for (const std::string& name : split_commas(text)) {
    const Leaves leaves = name == name_of(Leaves::kBoxes) ? Leaves::kBoxes : Leaves::kShapes;
    if (name != name_of(leaves) || std::count(out.begin(), out.end(), leaves) > 0)
      reject(option, text, "boxes, shapes or both");
    out.push_back(leaves);
  }
  return out;
}

}  // namespace

Command add_peers(CLI::App& app) {
  auto options = std::make_shared<PeersOptions>();
  PeersOptions& o = *options;
  o.robot.random_count = 100000;
  o.robot.import.sandbox = scenes::kImportSandbox;
  CLI::App& command =
      *app.add_subcommand("peers", "run the same crowds through other libraries: verified, and timed in turns");
  add_text(command, "--scene", scenes::scene_names(scenes::kPeersCommand, "|"),
           "crowds, separated by commas (default uniform,jitter)",
           [&o](const std::string& text) { o.scenes = split_commas(text); });
  add_read(command, "--characters", "LIST", o.character_counts,
           "numbers of characters, separated by commas (default 1000,10000, and 100000 of uniform)", read_number_list);
  add_rounds(command, o.rounds,
             "rounds, in each of which every set-up has one turn; times are their medians (default 9). Beyond 10000"
             " characters: fewer rounds, at least 3, of the best set-ups of each library");
  add_text(command, "--peers", "LIST",
           "libraries, separated by commas, of fcl, bullet, embree, ode (default: all in this build)",
           [&o](const std::string& text) { o.peers = split_commas(text); });
  add_read(command, "--leaves", "LIST", o.leaves,
           "what leaves are, separated by commas (default boxes,shapes)"
           "\n  boxes: by all libraries"
           "\n  shapes: capsules and ellipsoids, by cab, fcl and bullet",
           read_leaves);
  command.add_flag("--queries", o.queries,
                   "rays, spheres and points through cab, embree, bullet and fcl, in place of pairs (default 10000"
                   " characters; --leaves does not apply)");
  add_number(command, "--rays", o.rays,
             "with --queries: number of rays; a tenth as many spheres and points (default 100000)", 1, 10000000);
  CLI::Option* const past = command.add_flag(
      "--past", o.past,
      "shots at past moments of players, through cab alone, in place of crowds (--rounds of 30 ticks)");
  add_isa(command, o.isa);
  add_json(command, o.json_path, "write the tables as JSON");
  add_csv(command, o.csv_path, "write the tables as CSV");
  CLI::Option* const robot =
      add_path(command, "--robot", o.robot.file,
               "states of a robot in place of crowds, through cab and MuJoCo (if it is in this build): what they take,"
               " and how often they differ from the triangles of its meshes")
          ->type_name("FILE");
  add_srdf(command, o.robot.srdf_path)->needs(robot);
  add_path(command, "--also", o.also,
           "with --robot: a file of the same robot with other shapes, such as balls, which cab tests too")
      ->type_name("FILE")
      ->needs(robot);
  add_packages(command, o.robot.import)->needs(robot);
  add_leaves_per_link(command, o.robot.import)->needs(robot);
  add_number(command, "--states", o.robot.random_count, "with --robot: random states (default 100000)", 1, 100000000)
      ->needs(robot);
  add_number(command, "--seed", o.robot.seed, "with --robot: seed of the states (default 1)", 0,
             std::numeric_limits<std::uint32_t>::max())
      ->needs(robot);
  CLI::Option* const surfaces =
      command
          .add_option(
              "--surfaces", o.surfaces,
              "skins of files in contact in place of crowds, by every model of cab and by other libraries, beside "
              "the triangles in double: one file for a grid of its character, or several of one clock and world")
          ->type_name("FILE...");
  add_number(command, "--surface-characters", o.surface_characters,
             "with --surfaces FILE: number of characters (default 2)", 2, 10000)
      ->needs(surfaces);
  add_within(command, "--apart", "WIDTHS", o.apart,
             "with --surfaces FILE: how many widths characters are apart (default 0.45)", 0, 1e6)
      ->needs(surfaces);
  for (const char* const option : {"--scene", "--characters", "--peers", "--leaves", "--queries", "--rays", "--csv"})
    surfaces->excludes(command.get_option(option));
  surfaces->excludes(past)->excludes(robot);
  for (const char* const option : {"--scene", "--characters", "--peers", "--leaves", "--queries", "--rays"}) {
    robot->excludes(command.get_option(option));
    past->excludes(command.get_option(option));
  }
  robot->excludes(past)->excludes(command.get_option("--csv"));
  return {&command, [options] { return peers_command(*options); }};
}

}  // namespace cab::perf
