// What `cab peers` accepts.
#pragma once

#include <cab/types.h>

#include <cstdint>
#include <string>
#include <vector>

#include "perf/base/options.h"
#include "perf/measure/peers/peer.h"
#include "perf/tools/robot/options.h"

namespace cab::perf {

struct PeersOptions {
  std::vector<std::string> scenes = {"uniform", "jitter"};
  std::vector<std::uint32_t> character_counts;  // empty: the defaults of each scene
  std::uint32_t rounds = 9;
  std::vector<std::string> peers;  // empty: all of this build
  std::vector<Leaves> leaves = {Leaves::kBoxes, Leaves::kShapes};
  bool queries = false;                  // rays, spheres and points instead of pairs
  bool past = false;                     // shots at past moments instead of crowds
  std::uint32_t rays = 100000;           // a tenth as many spheres and points
  RobotCommandOptions robot;             // with a file: states of this robot instead of crowds
  std::string also;                      // a file of the same robot with other shapes; empty: none
  std::vector<std::string> surfaces;     // files of skins in contact instead of crowds: one for a grid of it, or more
  std::uint32_t surface_characters = 2;  // of one file
  double apart = 0.45;                   // of one file, in its widths
  Isa isa = Isa::kAuto;
  std::string json_path;  // empty: no file
  std::string csv_path;   // empty: no file
};
Command add_peers(CLI::App& app);
int peers_command(const PeersOptions& options);

}  // namespace cab::perf
