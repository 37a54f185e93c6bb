#include "perf/run/options.h"

#include <cab/cab.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "perf/base/option_values.h"

namespace cab::perf {
namespace {

constexpr const char* kUpForHeight = "axis for the height check; without it the axis along which the figure is tallest";

void add_body_options(CLI::App& command, scenes::BodyOptions& bodies) {
  command
      .add_option_function<std::string>(
          "--stature", [&bodies](const std::string& text) { bodies.stature = read_positive("--stature", text); },
          "height of the person, for thickness, heads, hands and feet; without it by the figure's own bones")
      ->type_name("METRES");
  command
      .add_option_function<std::string>(
          "--thickness", [&bodies](const std::string& text) { bodies.thickness = read_positive("--thickness", text); },
          "factor of the thickness of all bodies (default 1)")
      ->type_name("FACTOR");
}

}  // namespace

CLI::Option* add_world(CLI::App& command, WorldOptions& world, const std::string& meaning) {
  CLI::Option* files = command.add_option("FILE", world.files, meaning)->type_name("");
  command
      .add_option_function<std::vector<std::string>>(
          "--offset",
          [&world](const std::vector<std::string>& texts) {
            for (const std::string& text : texts) world.offsets.push_back(read_offset("--offset", text));
          },
          "metres to move a character; give it again for the next file")
      ->type_name("X,Y,Z")
      ->allow_extra_args(false);
  add_units(command, "file", world.metres_per_unit);
  add_up(command, world.up, kUpForHeight);
  add_body_options(command, world.bodies);
  command.add_option("--bodies", world.bodies_paths, "changes of bodies, once for all files or once per file")
      ->type_name("FILE.json")
      ->allow_extra_args(false);
  return files;
}

Command add_run(CLI::App& app) {
  auto options = std::make_shared<RunOptions>();
  RunOptions& o = *options;
  CLI::App& command = *app.add_subcommand("run", "which links touch in which frame: motion files in one world");
  add_world(command, o.world, "motion files, one character each")->required();
  command
      .add_option_function<std::string>(
          "--frames", [&o](const std::string& text) { o.frames = read_frame_range("--frames", text); },
          "only frames A to B - 1, counted from 0")
      ->type_name("A:B");
  add_policies(command, o.policies);
  add_isa(command, o.isa);
  add_threads(command, o.thread_count);
  CLI::Option* self =
      command.add_flag("--self", o.within,
                       "also test the links of each character against each other, and list the pairs that are masked");
  add_number(command, "--hops", o.world.ignored_hops, "mask links that are at most N joints apart", 1, kMaxLinks)
      ->needs(self);
  command.add_option("--rest-frame", o.world.rest_frame, "mask links whose boxes touch in frame F, counted from 0")
      ->type_name("F")
      ->needs(self);
  command.add_flag("--contacts", o.contacts,
                   "also the normal and depth of each hit, by the exact test; without --exact that is convex");
  command
      .add_option_function<std::string>(
          "--min-depth",
          [&o](const std::string& text) { o.min_depth = static_cast<float>(read_positive("--min-depth", text)); },
          "leave out hits that are less deep, by the exact test; without --exact that is convex")
      ->type_name("METRES");
  add_json(command, o.json_path, "write the table as JSON");
  command.add_option("--hits", o.hits_path, "write every hit as CSV")->type_name("OUT.csv");
  const CLI::Option* exact = command.get_option("--exact");
  return {&command, [options, exact] {
            const bool asks = options->contacts || options->min_depth > 0;
            if (asks && exact->count() == 0) options->policies.exact = Exact::kConvex;
            return run_command(*options);
          }};
}

Command add_inspect(CLI::App& app) {
  auto options = std::make_shared<InspectOptions>();
  InspectOptions& o = *options;
  CLI::App& command =
      *app.add_subcommand("inspect", "one frame of one file as JSON: joints, links, leaf boxes, merges, inner boxes");
  command.add_option("FILE", o.file, "motion file")->required()->type_name("");
  command.add_option("--frame", o.frame, "frame, counted from 0 (default 0)")->type_name("K");
  add_json(command, o.json_path, "file to write; without it the JSON goes to standard output");
  command
      .add_option_function<std::string>(
          "--offset", [&o](const std::string& text) { o.offset = read_offset("--offset", text); },
          "metres to move the character")
      ->type_name("X,Y,Z");
  command
      .add_option_function<std::string>(
          "--units", [&o](const std::string& text) { o.metres_per_unit = read_positive("--units", text); },
          "length unit of the file in metres (default 1)")
      ->type_name("METRES_PER_UNIT");
  add_up(command, o.up, kUpForHeight);
  add_body_options(command, o.bodies);
  CLI::Option* bodies = command.add_option("--bodies", o.bodies_path,
                                           "a table of all bodies instead of the frame; with a file, as changed by it");
  bodies->type_name("[FILE.json]")->expected(0, 1);
  command
      .add_option("--write-bodies", o.write_bodies_path, "write all bodies as JSON, to change and to give to --bodies")
      ->type_name("OUT.json");
  for (std::uint32_t field = 0; field < policy_table().size; ++field)
    if (std::string(policy_table()[field].name) == "refit") add_policy(command, field, o.policies);
  add_isa(command, o.isa);
  return {&command, [options, bodies] {
            options->prints_bodies = bodies->count() > 0;
            return inspect_command(*options);
          }};
}

}  // namespace cab::perf
