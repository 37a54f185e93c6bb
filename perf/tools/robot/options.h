// What `cab robot` accepts.
#pragma once

#include <cab/types.h>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "perf/base/options.h"
#include "perf/tools/replay/options.h"
#include "scenes/robot/robot.h"

namespace cab::perf {

struct RobotCommandOptions {
  std::string file;
  scenes::RobotOptions import;
  std::string srdf_path;                             // empty: the matrix comes from sampling
  std::uint32_t samples = 10000;                     // random states for the matrix, without srdf_path
  std::vector<std::pair<std::string, double>> rest;  // of variables by name; others rest as their file says
  std::uint32_t random_count = 1000;                 // random states to check, without states_path
  std::string states_path;                           // empty: random states
  std::uint32_t seed = 1;
  std::vector<std::string> around;                             // files of robots that stand around, at rest
  double margin = 0;                                           // metres
  std::vector<std::pair<std::string, double>> padding;         // metres by link; of no name: of all others
  std::vector<std::pair<std::string, std::string>> distances;  // names of links
  Policies policies;
  Isa isa = Isa::kAuto;
  std::uint32_t thread_count = 1;  // 0: every core
  std::string json_path;           // empty: no file
  std::string hits_path;           // empty: no file
  RecordFileOptions recording;     // of the states that are checked, one frame each
};
// Adds --leaves-per-link, --package, --srdf, and --states.
CLI::Option* add_leaves_per_link(CLI::App& command, scenes::RobotOptions& import);
CLI::Option* add_packages(CLI::App& command, scenes::RobotOptions& import);
CLI::Option* add_srdf(CLI::App& command, std::string& path);
CLI::Option* add_states(CLI::App& command, std::string& path);
Command add_robot(CLI::App& app);
int robot_command(const RobotCommandOptions& options);

}  // namespace cab::perf
