#include "perf/tools/run/options.h"

#include <cab/cab.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "perf/base/usage.h"

namespace cab::perf {
namespace {

constexpr const char* kUpForHeight = "axis for the height check; without it the axis along which the figure is tallest";
constexpr const char* kStandardOutput = "-";
constexpr const char* kFormats =
    "\n  BVH; glTF, FBX, COLLADA and more through assimp; ASF for a pose, AMC for a motion, with 11.asf or 11_01.asf"
    " beside 11_01.amc";

void add_fps(CLI::App& command, double& frames_per_second) {
  add_read(command, "--fps", "N", frames_per_second, "frames a second of AMC files, which do not say it (default 120)",
           read_positive);
}

// The bits of rig::BodyKind for words separated by commas.
std::uint32_t read_kinds(const std::string& option, const std::string& text) {
  const std::vector<std::pair<std::string, std::uint32_t>> kinds = {{"hull", rig::kHullBody},
                                                                    {"box", rig::kBoxBody},
                                                                    {"capsule", rig::kCapsuleBody},
                                                                    {"sphere", rig::kSphereBody},
                                                                    {"ellipsoid", rig::kEllipsoidBody}};
  std::uint32_t bits = 0;
  for (const std::string& word : split_commas(text)) {
    const auto kind = std::find_if(kinds.begin(), kinds.end(), [&](const auto& k) { return k.first == word; });
    if (kind == kinds.end()) reject(option, text, "hull, box, capsule, sphere and ellipsoid, separated by commas");
    bits |= kind->second;
  }
  return bits;
}

// Adds --motion and --motion-units, each for one file or for several.
template <class Paths, class Unit>
void add_motion(CLI::App& command, Paths& paths, Unit set_unit, const std::string& how_often) {
  CLI::Option* motion = command.add_option(
      "--motion", paths, "another file that has the motion, of nodes with the same names" + how_often);
  motion->type_name("FILE")->allow_extra_args(false);
  refuse_empty(*motion);
  add_texts(command, "--motion-units", "METRES_PER_UNIT", "length unit of that file in metres (default: that of FILE)",
            [set_unit](const std::string& text) { set_unit(read_metres_per_unit("--motion-units", text)); });
}

// Adds --animation, and --body with the options that need it.
void add_skin_options(CLI::App& command, std::string& animation, std::optional<scenes::SkinOptions>& skin) {
  command
      .add_option("--animation", animation,
                  "animation to read, of --motion if given, by name or by number from 0 (default the first)")
      ->type_name("NAME");
  add_text(command, "--body", "KIND",
           "what bodies are made of: skeleton (default); skin: solids about the meshes that joints move; surface: the"
           " triangles of these meshes, in boxes that follow them",
           [&skin](const std::string& text) {
             if (text == "skin" || text == "surface")
               skin.emplace().surface = text == "surface";
             else if (text != "skeleton")
               reject("--body", text, "skeleton, skin or surface");
           });
  const auto of_skin = [&skin](const char* option) -> scenes::SkinOptions& {
    if (!skin || skin->surface) throw UsageError(std::string(option) + ": needs --body skin");
    return *skin;
  };
  add_text(command, "--kinds", "KIND,...",
           "bodies to choose from, each leaf the smallest: hull (default), box, capsule, sphere, ellipsoid",
           [of_skin](const std::string& text) { of_skin("--kinds").kinds = read_kinds("--kinds", text); });
  add_text(command, "--leaves-per-link", "N",
           "leaves on a link at most, 1 (default) to 64: meshes are cut where that saves volume",
           [of_skin](const std::string& text) {
             const std::uint64_t leaves = read_number("--leaves-per-link", text, 1, 64);
             of_skin("--leaves-per-link").leaves_per_link = static_cast<std::uint32_t>(leaves);
           });
  command.add_flag_callback(
      "--inflate", [of_skin] { of_skin("--inflate").inflate = true; },
      "let bodies grow until the surface is inside of them in all frames");
  add_text(command, "--links", "JOINT,...", "only these joints get links; the meshes of others go to the joint above",
           [of_skin](const std::string& text) { of_skin("--links").kept_joints = split_commas(text); });
  add_text(command, "--least-reach", "METRES", "skip joints whose meshes and children reach less than this",
           [of_skin](const std::string& text) {
             of_skin("--least-reach").least_reach = read_positive("--least-reach", text);
           });
}

void add_body_options(CLI::App& command, scenes::BodyOptions& bodies) {
  add_read(command, "--stature", "METRES", bodies.stature,
           "height of the person, for thickness, heads, hands and feet; without it by the figure's own bones",
           read_positive);
  add_read(command, "--thickness", "FACTOR", bodies.thickness, "factor of the thickness of all bodies (default 1)",
           read_positive);
}

}  // namespace

CLI::Option* add_world(CLI::App& command, WorldOptions& world, const std::string& meaning) {
  CLI::Option* files = command.add_option("FILE", world.files, meaning + kFormats)->type_name("");
  refuse_empty(*files);
  add_texts(command, "--offset", "X,Y,Z", "metres to move a character; give it again for the next file",
            [&world](const std::string& text) { world.offsets.push_back(read_offset("--offset", text)); });
  add_units(command, "file", world.metres_per_unit);
  add_fps(command, world.frames_per_second);
  add_up(command, world.up, kUpForHeight);
  add_no_sandbox(command, world.sandbox);
  add_motion(
      command, world.motion_paths, [&world](double unit) { world.motion_units.push_back(unit); },
      "; once for all files or once per file, none for one with its own");
  add_skin_options(command, world.animation, world.skin);
  add_body_options(command, world.bodies);
  command.add_option("--bodies", world.bodies_paths, "changes of bodies, once for all files or once per file")
      ->type_name("FILE.json")
      ->allow_extra_args(false);
  return files;
}

void add_run_of_files(CLI::App& command, RunOptions& run, const std::string& meaning) {
  run.policies.exact = Exact::kConvex;
  run.world.ignored_hops = kDefaultHops;
  add_world(command, run.world, meaning)->required();
  add_read(command, "--frames", "N|A:B", run.frames, "only the first N frames, or frames A to B - 1, counted from 0",
           read_frame_range);
  CLI::Option* self =
      command.add_flag("--self", run.within, "also test the links of each character against each other");
  add_number(command, "--hops", run.world.ignored_hops,
             "leave out links that are at most N joints apart (default " + std::to_string(kDefaultHops) +
                 "); 0: only those that share a joint",
             0, kMaxLinks)
      ->needs(self);
  add_number(command, "--rest-frame", run.world.rest_frame, "leave out links whose boxes touch in frame F, from 0", 0,
             std::numeric_limits<std::uint32_t>::max())
      ->type_name("F")
      ->needs(self);
  command.add_flag("--quiet", run.quiet, "print no notes about the files, only warnings");
}

Command add_run(CLI::App& app) {
  auto options = std::make_shared<RunOptions>();
  RunOptions& o = *options;
  CLI::App& command = *app.add_subcommand("run", "find touching links in motion files, frame by frame");
  add_run_of_files(command, o, "motion files, one character each");
  add_policies(command, o.policies);
  add_isa(command, o.isa);
  add_threads(command, o.thread_count);
  add_read(command, "--min-depth", "METRES", o.min_depth, "leave out hits that are less deep", read_positive);
  command.add_flag_callback(
      "--no-containment", [&o] { o.containment = false; },
      "with --exact surface: what is wholly inside a closed part of a surface is no hit");
  command.add_flag("--stats", o.stats, "also print what the engine counted and timed");
  add_json(command, o.json_path, "write all pairs, counts and times as JSON");
  add_path(command, "--hits", o.hits_path, "write every hit as CSV, with its second, depth, normal and point")
      ->type_name("OUT.csv");
  add_record_file(command, "--record", o.recording, "write a recording, to replay and to look at");
  const CLI::Option* exact = command.get_option("--exact");
  return {&command, [options, exact] {
            // A preset says nothing about exact tests.
            if (exact->count() == 0) options->policies.exact = default_exact(options->world);
            return run_command(*options);
          }};
}

Command add_inspect(CLI::App& app) {
  auto options = std::make_shared<InspectOptions>();
  InspectOptions& o = *options;
  CLI::App& command =
      *app.add_subcommand("inspect", "say what a file becomes: joints, bodies, what is masked, merged and guessed");
  add_path(command, "FILE", o.file, std::string("motion file") + kFormats)->required()->type_name("");
  CLI::Option* frame =
      add_read(command, "--frame", "K|last", o.frame, "frame of --json, counted from 0 (default 0)", read_frame);
  CLI::Option* json =
      add_path(command, "--json", o.json_path,
               "write the joints, links, leaf boxes, merges and inner boxes of a frame as JSON; without a file, or "
               "with -, to standard output, in the place of the summary");
  json->option_text("[OUT]")->expected(0, 1)->default_str(kStandardOutput);
  add_read(command, "--offset", "X,Y,Z", o.offset, "metres to move the character", read_offset);
  add_read(command, "--units", "METRES_PER_UNIT", o.metres_per_unit, kUnitMeaning, read_unit);
  add_fps(command, o.frames_per_second);
  add_up(command, o.up, kUpForHeight);
  add_no_sandbox(command, o.sandbox);
  add_motion(
      command, o.motion_path, [&o](double unit) { o.motion_units = unit; }, "");
  add_skin_options(command, o.animation, o.skin);
  add_body_options(command, o.bodies);
  add_path(command, "--bodies", o.bodies_path, "changes of bodies")->type_name("FILE.json");
  add_path(command, "--write-bodies", o.write_bodies_path,
           "write all bodies as JSON, to change and to give to --bodies")
      ->type_name("OUT.json");
  add_policy(command, policy_row("refit"), o.policies);
  add_isa(command, o.isa);
  const CLI::Option* const refit = command.get_option("--refit");
  const CLI::Option* const isa = command.get_option("--isa");
  return {&command, [options, frame, json, refit, isa] {
            options->names_frame = frame->count() > 0;
            options->writes_json = json->count() > 0;
            for (const CLI::Option* option : {refit, isa})
              if (option->count() > 0) options->box_options.push_back(option->get_name());
            // CLI11 checks no text that is empty if there may be none.
            if (options->writes_json && options->json_path.empty())
              throw UsageError("--json: '' names no file; give a path, or none for standard output");
            if (options->json_path == kStandardOutput) options->json_path.clear();
            return inspect_command(*options);
          }};
}

}  // namespace cab::perf
