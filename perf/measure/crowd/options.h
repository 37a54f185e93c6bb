// What `cab crowd` accepts.
#pragma once

#include <cab/types.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "perf/base/crowd_session.h"
#include "perf/base/options.h"
#include "scenes/crowd/ropes.h"
#include "scenes/import/limits.h"

namespace cab::perf {

// The most characters of a crowd that ranks share.
inline constexpr std::uint32_t kMaxSharedCrowd = 100000000;

struct CrowdOptions {
  std::string scene;
  bool spatial_order = false;  // store the characters in the order of cab::spatial_order
  std::uint32_t character_count = 10000;
  std::uint32_t frame_count = 8;
  std::uint32_t rounds = 7;
  std::vector<std::string> clips;
  std::vector<double> metres_per_unit;                      // empty, one for all clips, or one per clip
  char up = 0;                                              // the up axis: 'x', 'y', 'z', or 0 to find it
  std::string trajectories_path;                            // empty: no file
  std::optional<double> frames_per_second;                  // of trajectories that do not say it
  std::optional<std::uint32_t> boxes_per_link, link_count;  // empty: the scene's default, if it has such a size
  std::optional<scenes::RopeShape> rope_shape;
  std::optional<double> rope_spacing;
  Policies policies;
  CoarseShare coarse;
  bool sweep = false;          // find what may have touched since the frame before
  std::optional<double> area;  // square metres per character; empty: the scene's default
  std::optional<scenes::LevelKind> level;
  std::optional<scenes::SkinLeafKind> skin_leaves;
  std::optional<AtRest> at_rest;  // what is done with those who stand; empty: the scene's default
  bool in_contact = false;        // ask only which characters touch anything
  Isa isa = Isa::kAuto;
  std::uint32_t thread_count = 1;  // 0: every core
  bool mpi = false;                // all ranks of an MPI program share the crowd
  std::string out_folder;          // of the hits of all ranks; empty: hits are only counted
  std::uint32_t checkpoint = 32;   // frames after which the hits are safe on disk and the crowd is cut anew
  std::string json_path;           // empty: no file
  std::string csv_path;            // empty: no file

  // Files are read in a child process with these limits; empty: in this process.
  std::optional<scenes::SandboxLimits> sandbox = scenes::kImportSandbox;
};
Command add_crowd(CLI::App& app);
int crowd_command(const CrowdOptions& options);

}  // namespace cab::perf
