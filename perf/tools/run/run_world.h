// The world of motion files for `cab run` and `cab sweep`.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "scenes/import/import.h"
#include "scenes/import/limits.h"
#include "scenes/rig/skeleton_bodies.h"
#include "scenes/scene.h"

namespace cab::perf {

// In the place of a motion's path: the file has its own.
inline constexpr const char* kOwnMotion = "none";

inline constexpr const char* kUnitsNeedMotion = "--motion-units: needs --motion";

struct WorldOptions {
  std::vector<std::string> files;              // one character each
  std::vector<std::array<double, 3>> offsets;  // metres; of the first files in their order; the others have offset 0
  std::vector<double> metres_per_unit;         // empty, one for all files, or one per file; kAutoUnit: guessed
  double frames_per_second = 0;                // of files that do not say it; 0: 120
  scenes::BodyOptions bodies;                  // stature and thickness of every figure
  std::vector<std::string> bodies_paths;       // empty, one file of bodies for all files, or one per file
  char up = 0;                                 // the up axis: 'x', 'y', 'z', or 0 to find it
  std::vector<std::string> motion_paths;       // empty, one motion for all files, or one per file; kOwnMotion: none
  std::vector<double> motion_units;            // metres; empty, one for all motions, or one per file
  std::string animation;                       // name or number of each motion's animation; empty: the first
  std::optional<scenes::SkinOptions> skin;     // bodies of the meshes
  std::uint32_t ignored_hops = 0;              // links of one character at most this many joints apart are masked
  std::optional<std::uint32_t> rest_frame;     // links of one character that touch in this frame are masked

  // Files are read in a child process with these limits; empty: in this process.
  std::optional<scenes::SandboxLimits> sandbox = scenes::kImportSandbox;
};

// Throws UsageError if offsets, units, motions or bodies do not fit the files.
void check_files(const WorldOptions& options);

// The exact test of the bodies if none is chosen: of their triangles, or of solids.
Exact default_exact(const WorldOptions& options);

// Throws UsageError for an exact test of solids if bodies are surfaces, and for one of surfaces if they are not.
void check_exact(const WorldOptions& options, Exact exact);

// The file that has the motion of a character's file; empty if that has its own.
std::string motion_path(const WorldOptions& options, std::size_t file);

// The files of characters and of their motions.
std::vector<std::string> input_paths(const WorldOptions& options);

// One character per file, each with a name of its own, in one world and on one clock. Throws UsageError if the rest
// frame does not exist, and std::runtime_error for bad files. `report`, if it is not null, receives what import did.
scenes::Scene import_world(const WorldOptions& options, scenes::ImportReport* report = nullptr);

}  // namespace cab::perf
