// The sub-commands of `cab`: what the command line hands to each. main.cpp fills the options, each command has its
// own file. A command returns the exit code 0, or 1 where its own checks fail; it throws for wrong use and bad data.
#pragma once

#include <cab/types.h>

#include <array>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "perf/base/engine_session.h"
#include "scenes/crowd/ropes.h"

namespace cab::perf {

// Wrong use of the command line, in one line that says how to do it right: exit code 2. Every other exception is
// bad data or a failure: exit code 1.
class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct RunOptions {
  std::vector<std::string> files;
  std::vector<std::array<double, 3>> offsets;  // metres; the first of the files in order, the others stay at zero
  std::vector<double> metres_per_unit;         // none, one for all files, or one a file
  char up = 0;                                 // 'x', 'y', 'z', or 0 to find it
  std::optional<FrameRange> frames;            // none: all
  Policies policies;
  Isa isa = Isa::kAuto;
  std::uint32_t thread_count = 1;           // 0: every core
  bool within = false;                      // also the links of one character against each other, but for:
  std::uint32_t ignored_hops = 0;           // links this many joints apart or less
  std::optional<std::uint32_t> rest_frame;  // links that touch in this frame
  bool contacts = false;                    // normal and depth
  std::string json_path;                    // empty: none
  std::string hits_path;                    // empty: none
};
int run_command(const RunOptions& options);

struct InspectOptions {
  std::string file;
  std::uint32_t frame = 0;
  std::array<double, 3> offset = {0, 0, 0};  // metres
  double metres_per_unit = 1;
  char up = 0;
  Policies policies;
  Isa isa = Isa::kAuto;
  std::string json_path;  // empty: standard output
};
int inspect_command(const InspectOptions& options);

struct PaperOptions {
  std::vector<std::uint32_t> tables;
  std::uint32_t frame_count = 0;  // 0: as many as the paper ran
  LaneContent lanes = LaneContent::kFrames;
  Isa isa = Isa::kAuto;
  std::uint32_t thread_count = 1;  // 0: every core
  std::string json_path;           // empty: none
  std::string csv_path;            // empty: none
};
int paper_command(const PaperOptions& options);

struct CrowdOptions {
  std::string scene;
  std::uint32_t character_count = 0;
  std::uint32_t frame_count = 0;
  std::uint32_t rounds = 0;
  std::vector<std::string> clips;
  std::vector<double> metres_per_unit;                      // none, one for all clips, or one a clip
  char up = 0;                                              // 'x', 'y', 'z', or 0 to find it
  std::string trajectories_path;                            // empty: none
  std::optional<std::uint32_t> boxes_per_link, rope_links;  // none: as by default, or not for the scene
  std::optional<scenes::RopeShape> rope_shape;
  std::optional<double> rope_spacing;
  Policies policies;
  bool in_contact = false;  // ask only which characters touch anything
  Isa isa = Isa::kAuto;
  std::uint32_t thread_count = 1;  // 0: every core
  std::string json_path;           // empty: none
  std::string csv_path;            // empty: none
};
int crowd_command(const CrowdOptions& options);

struct PeersOptions {
  std::vector<std::string> scenes;              // of uniform and jitter
  std::vector<std::uint32_t> character_counts;  // none: as many as each scene is run with by default
  std::uint32_t rounds = 0;
  std::vector<std::string> peers;  // none: all of this build
  Isa isa = Isa::kAuto;
  std::string json_path;  // empty: none
  std::string csv_path;   // empty: none
};
int peers_command(const PeersOptions& options);

struct SweepOptions {
  RunOptions world;                                // its files, offsets, units and up axis
  std::vector<std::string> scenes;                 // of kSweepScenes; none: those by default, or the files alone
  std::vector<std::vector<std::uint32_t>> values;  // of each row of policy_table(); none: all that make a difference
  std::vector<Isa> isas = {Isa::kAuto};
  std::vector<std::uint32_t> thread_counts = {1};  // 0: every core
  std::uint32_t character_count = 0;               // of a crowd; 0: as many as by default
  std::uint32_t rounds = 0;
  std::string json_path;    // empty: none
  std::string csv_path;     // empty: none
  std::string plot_folder;  // empty: none
};
int sweep_command(const SweepOptions& options);

struct KernelsOptions {
  std::string isas;  // names separated by commas, each one available; empty: every available one
  std::uint32_t rounds = 0;
};
int kernels_command(const KernelsOptions& options);

struct ContinuityOptions {
  std::uint32_t step_count = 20000;
  Isa isa = Isa::kAuto;
  std::string json_path;  // empty: none
  std::string csv_path;   // empty: none
};
int continuity_command(const ContinuityOptions& options);
struct VerifyOptions {
  double minutes = 1;                   // unless rounds or round are given
  std::optional<std::uint64_t> rounds;  // this many
  std::optional<std::uint64_t> round;   // this one alone
  std::uint64_t seed = 1;
  Isa isa = Isa::kAuto;
  std::uint32_t thread_count = 0;  // 0: every core
  std::string resume_path;         // empty: none
  std::string json_path;           // empty: none
};
int verify_command(const VerifyOptions& options);

}  // namespace cab::perf
