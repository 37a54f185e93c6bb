#include "perf/tools/robot/options.h"

#include <CLI/CLI.hpp>
#include <cmath>
#include <limits>
#include <memory>

#include "perf/base/option_values.h"
#include "perf/base/usage.h"
#include "scenes/import/limits.h"
#include "scenes/import/words.h"

namespace cab::perf {
namespace {

// The most random states, which take hours for a large robot.
constexpr std::uint32_t kMaxStates = 100000000;

scenes::MissingMesh read_missing_mesh(const std::string& text, double& radius) {
  if (text == "refuse") return scenes::MissingMesh::kRefuse;
  if (text == "none") return scenes::MissingMesh::kLeaveOut;
  if (text.empty() || text.find_first_not_of("0123456789.e-") != std::string::npos)
    reject("--missing-mesh", text, "refuse, none, or the radius of a ball in metres, for example 0.05");
  radius = read_positive("--missing-mesh", text);
  return scenes::MissingMesh::kBall;
}

// The two texts on both sides of a separator.
std::pair<std::string, std::string> read_two(const std::string& option, const std::string& text, char separator,
                                             const std::string& wanted) {
  const std::size_t at = text.find(separator);
  if (at == std::string::npos || at == 0 || at + 1 == text.size()) reject(option, text, wanted);
  return {text.substr(0, at), text.substr(at + 1)};
}

// Values of joints by their names, in radians and metres.
std::vector<std::pair<std::string, double>> read_rest(const std::string& text) {
  std::vector<std::pair<std::string, double>> values;
  for (const std::string& part : split_commas(text)) {
    const auto [name, number] = read_two("--rest", part, '=', "JOINT=VALUE, such as elbow=0.5,wrist=-1");
    double value = 0;
    if (!scenes::read_number(number, value) || !(std::fabs(value) <= scenes::kMaxImportValue))
      reject("--rest", part, "JOINT=VALUE with a number from -1e9 to 1e9");
    values.emplace_back(name, value);
  }
  return values;
}

// Lengths of links by their names, in metres. A length without a name is that of all links that are not named.
std::vector<std::pair<std::string, double>> read_padding(const std::string& text) {
  std::vector<std::pair<std::string, double>> lengths;
  for (const std::string& part : split_commas(text)) {
    const std::string wanted = "METRES or LINK=METRES with a number from 0 to 1e6";
    const bool named = part.find('=') != std::string::npos;
    const auto [name, number] = named ? read_two("--padding", part, '=', wanted) : std::pair(std::string(), part);
    double metres = 0;
    if (!scenes::read_number(number, metres) || !(metres >= 0 && metres <= 1e6)) reject("--padding", part, wanted);
    lengths.emplace_back(name, metres);
  }
  return lengths;
}

void add_files(CLI::App& command, RobotCommandOptions& o) {
  add_path(command, "FILE", o.file, "robot: URDF or MJCF, as its first element says")->required()->type_name("");
  add_packages(command, o.import);
  command
      .add_option("--root", o.import.root,
                  "a folder whose meshes and included files an MJCF file may name; without it those of its package, or "
                  "up to two folders above it")
      ->type_name("DIR")
      ->check(CLI::ExistingDirectory);
  command
      .add_option("--ignore", o.import.ignored_words,
                  "pass over an element or attribute of an MJCF file that is not read; give it again for others")
      ->type_name("WORD")
      ->allow_extra_args(false);
  command
      .add_option_function<std::string>(
          "--missing-mesh",
          [&o](const std::string& text) { o.import.missing_mesh = read_missing_mesh(text, o.import.ball_radius); },
          "a mesh of a URDF file that is not there (default refuse): refuse the robot, take no shape for it, or a ball "
          "of this radius in metres")
      ->type_name("refuse|none|RADIUS");
  add_text(
      command, "--shapes", "hulls|surface",
      "what meshes become (default hulls): convex hulls; or surface: their triangles, without an inside, a depth or a"
      " distance",
      [&o](const std::string& text) {
        if (text != "hulls" && text != "surface") reject("--shapes", text, "hulls or surface");
        o.import.surface = text == "surface";
      });
  add_leaves_per_link(command, o.import);
  add_no_sandbox(command, o.import.sandbox);
}

// What surfaces do not go with. A preset says nothing about exact tests.
void check_shapes(RobotCommandOptions& o, bool has_exact) {
  const bool is_of_solids = o.policies.exact == Exact::kConvex || o.policies.exact == Exact::kFcl;
  if (o.import.surface && has_exact && is_of_solids)
    throw UsageError(
        "--shapes surface: the exact tests convex and fcl are about solids; leave --exact out, or choose"
        " --shapes hulls");
  if (!has_exact) o.policies.exact = o.import.surface ? Exact::kSurface : Exact::kConvex;
  if (!o.import.surface && o.policies.exact == Exact::kSurface)
    throw UsageError("--exact surface: needs --shapes surface, whose triangles it tests");
  if (!o.import.surface) return;
  if (o.import.leaves_per_link > 1)
    throw UsageError("--leaves-per-link: it cuts hulls, and --shapes surface has none; leave one of them out");
  if (!o.distances.empty())
    throw UsageError("--distance: triangles have no depth and no distance; choose --shapes hulls");
  if (!o.padding.empty())
    throw UsageError("--padding: triangles are not grown; choose --shapes hulls, or --margin for all pairs");
}

}  // namespace

CLI::Option* add_leaves_per_link(CLI::App& command, scenes::RobotOptions& import) {
  return add_number(command, "--leaves-per-link", import.leaves_per_link,
                    "hulls of a mesh at most, 1 (default) to 64: meshes are cut where that saves volume", 1, 64);
}

CLI::Option* add_packages(CLI::App& command, scenes::RobotOptions& import) {
  return add_texts(command, "--package", "NAME=DIR",
                   "folder of package://NAME paths; without it the package is looked for above and beside the file, in "
                   "ROS_PACKAGE_PATH and in AMENT_PREFIX_PATH; give it again for others",
                   [&import](const std::string& text) {
                     import.packages.push_back(read_two("--package", text, '=', "NAME=DIR: a package and its folder"));
                   });
}

CLI::Option* add_srdf(CLI::App& command, std::string& path) {
  return add_path(command, "--srdf", path, "take the masked pairs from this file; none are derived")
      ->type_name("FILE.srdf");
}

CLI::Option* add_states(CLI::App& command, std::string& path) {
  return add_path(command, "--states", path,
                  "check the states of a CSV file: a line of joint names, then a line of values per state")
      ->type_name("FILE.csv");
}

Command add_robot(CLI::App& app) {
  auto options = std::make_shared<RobotCommandOptions>();
  RobotCommandOptions& o = *options;
  o.import.sandbox = scenes::kImportSandbox;
  o.policies.exact = Exact::kConvex;  // boxes of links are not enough for robots
  CLI::App& command = *app.add_subcommand("robot", "find the links of a robot that touch each other, by joint states");
  add_files(command, o);
  CLI::Option* samples = add_number(
      command, "--samples", o.samples,
      "random states that decide which pairs touch always or never (default 10000); 0: none are masked for that, nor "
      "for touching at rest",
      0, kMaxStates);
  add_srdf(command, o.srdf_path)->excludes(samples);
  add_texts(command, "--rest", "JOINT=VALUE,...",
            "the rest state, in radians and metres: pairs that touch in it and in 95 % of the samples are masked, and "
            "joints without a column in --states have it; joints that are not named rest as the file says",
            [&o](const std::string& text) {
              for (auto& value : read_rest(text)) o.rest.push_back(std::move(value));
            });
  CLI::Option* random =
      add_number(command, "--random", o.random_count, "random states to check (default 1000)", 1, kMaxStates);
  add_states(command, o.states_path)->excludes(random);
  add_number(command, "--seed", o.seed, "seed of random states (default 1)", 0,
             std::numeric_limits<std::uint32_t>::max());
  add_texts(command, "--distance", "A,B",
            "least and greatest distance of two links over all states; give it again for other pairs",
            [&o](const std::string& text) {
              o.distances.push_back(read_two("--distance", text, ',', "A,B: the names of two links"));
            });
  command
      .add_option("--around", o.around,
                  "a URDF or MJCF file of what stands around, in the robot's frame: its links are tested at rest "
                  "against those of the robot; give it again for others")
      ->type_name("FILE")
      ->allow_extra_args(false);
  add_within(command, "--margin", "METRES", o.margin,
             "metres that links are apart at least, closer ones touch (default 0)", 0, 1e6);
  add_texts(command, "--padding", "METRES,LINK=METRES,...",
            "metres by which links grow against what stands around, not against each other: a number is for all links, "
            "LINK=METRES for one; needs --around",
            [&o](const std::string& text) {
              for (auto& length : read_padding(text)) o.padding.push_back(std::move(length));
            });
  add_policies(command, o.policies);
  add_isa(command, o.isa);
  add_threads(command, o.thread_count);
  add_json(command, o.json_path, "write the table, the matrix and all pairs that touch as JSON");
  add_path(command, "--hits", o.hits_path, "write every hit as CSV")->type_name("OUT.csv");
  add_record_file(command, "--record", o.recording,
                  "write a recording of the checked states, to replay and to look at");
  const CLI::Option* exact = command.get_option("--exact");
  return {&command, [options, exact] {
            check_shapes(*options, exact->count() > 0);
            return robot_command(*options);
          }};
}

}  // namespace cab::perf
