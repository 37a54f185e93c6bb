// What `cab view` accepts.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "perf/base/options.h"
#include "perf/tools/robot/options.h"
#include "perf/tools/run/options.h"

namespace cab::perf {

struct ViewOptions {
  RunOptions run;                                          // of motion files; all files are those of its world
  RobotCommandOptions robot;                               // of a robot
  std::vector<std::string> motion_options, robot_options;  // those of the command line that are about one kind of file
  std::string out_path;                                    // empty: as the first file, with .html
  std::string page_path;                                   // of the viewer; empty: beside the command
  std::uint32_t frame = 0;                                 // that the link opens
};
Command add_view(CLI::App& app);
int view_command(const ViewOptions& options);

}  // namespace cab::perf
