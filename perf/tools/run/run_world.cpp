#include "perf/tools/run/run_world.h"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>

#include "perf/base/options.h"
#include "perf/base/report.h"
#include "perf/base/usage.h"
#include "perf/tools/run/bodies_file.h"
#include "scenes/import/import.h"

namespace cab::perf {
namespace {

bool has_surface(const WorldOptions& options) { return options.skin && options.skin->surface; }

// Whether reading a file takes over a quarter of a second: one of 3.4 MB, assimp's 01_03.bvh, took 0.5 s.
bool takes_long(const std::string& path) {
  constexpr std::uintmax_t kBytes = 1 << 21;
  std::error_code error;
  const std::uintmax_t bytes = std::filesystem::file_size(path, error);
  return !error && bytes >= kBytes;
}

// Gives a character without motion the same pose in every frame, so that it is tested like a moving one.
void hold_in_every_frame(scenes::Character& character, std::uint32_t frame_count) {
  if (!character.is_static) return;
  const std::vector<float> poses = std::move(character.poses);
  const std::vector<double> origins = std::move(character.origins);
  character.poses.clear();
  character.origins.clear();
  for (std::uint32_t f = 0; f < frame_count; ++f) {
    character.poses.insert(character.poses.end(), poses.begin(), poses.end());
    character.origins.insert(character.origins.end(), origins.begin(), origins.end());
  }
  character.is_static = false;
}

// Of an option that passed check_given and is given.
template <class Value>
const Value& value_of(const std::vector<Value>& values, std::size_t file) {
  return values[values.size() == 1 ? 0 : file];
}

}  // namespace

void check_files(const WorldOptions& options) {
  const std::size_t files = options.files.size();
  for (const std::string& file : options.files) {
    std::error_code ignored;
    if (std::filesystem::is_directory(file, ignored))
      throw std::runtime_error(file +
                               " is a folder; `cab scan self FOLDER` and `cab scan pairs FOLDER` test what is in it");
  }
  if (options.offsets.size() > files)
    throw UsageError("--offset: given " + std::to_string(options.offsets.size()) + " times for " +
                     std::to_string(files) + " files; give at most one per file, in their order");
  check_given("--units", options.metres_per_unit.size(), files, "file");
  check_given("--motion", options.motion_paths.size(), files, "file");
  check_given("--motion-units", options.motion_units.size(), files, "file");
  if (!options.motion_units.empty() && options.motion_paths.empty()) throw UsageError(kUnitsNeedMotion);
  if (options.skin && !options.bodies_paths.empty())
    throw UsageError("--bodies is about bodies of the skeleton, not of --body skin or surface");
  check_given("--bodies", options.bodies_paths.size(), files, "file");
}

Exact default_exact(const WorldOptions& options) { return has_surface(options) ? Exact::kSurface : Exact::kConvex; }

void check_exact(const WorldOptions& options, Exact exact) {
  if (has_surface(options) && (exact == Exact::kConvex || exact == Exact::kFcl))
    throw UsageError(
        "--body surface: the exact tests convex and fcl, and depths, are about solids; leave them out, or choose"
        " --body skin");
  if (!has_surface(options) && exact == Exact::kSurface)
    throw UsageError("--exact surface: needs --body surface, whose triangles it tests");
}

std::string motion_path(const WorldOptions& options, std::size_t file) {
  const std::string path = options.motion_paths.empty() ? kOwnMotion : value_of(options.motion_paths, file);
  return path == kOwnMotion ? std::string() : path;
}

std::vector<std::string> input_paths(const WorldOptions& options) {
  std::vector<std::string> paths = options.files;
  for (std::size_t f = 0; f < options.files.size(); ++f)
    if (const std::string path = motion_path(options, f); !path.empty()) paths.push_back(path);
  paths.insert(paths.end(), options.bodies_paths.begin(), options.bodies_paths.end());
  return paths;
}

scenes::Scene import_world(const WorldOptions& options, scenes::ImportReport* report) {
  std::vector<scenes::Clip> clips;
  ProgressBar bar("files", options.files.size());
  for (std::size_t f = 0; f < options.files.size(); ++f) {
    scenes::ImportOptions import;
    import.up = options.up;
    import.sandbox = options.sandbox;
    import.animation = options.animation;
    import.skin = options.skin;
    import.frames_per_second = options.frames_per_second;
    import.bodies = options.bodies;
    if (!options.bodies_paths.empty())
      import.body_changes = read_bodies(value_of(options.bodies_paths, f), options.sandbox);
    if (f < options.offsets.size()) import.offset = options.offsets[f];
    if (!options.metres_per_unit.empty()) set_unit(value_of(options.metres_per_unit, f), import);
    if (const std::string path = motion_path(options, f); !path.empty())
      import.motion = scenes::MotionFile{path, options.motion_units.empty() ? 0 : value_of(options.motion_units, f)};
    if (takes_long(options.files[f]) || (import.motion && takes_long(import.motion->path))) bar.begin_long_step();
    clips.push_back(scenes::import_clip(options.files[f], import));
    bar.advance(1);
  }
  scenes::Scene scene = scenes::make_world(std::move(clips), report);

  if (options.rest_frame && *options.rest_frame >= scene.frame_count)
    throw UsageError("--rest-frame: there is no frame " + std::to_string(*options.rest_frame) + " among the scene's " +
                     std::to_string(scene.frame_count) + "; frames are counted from 0");
  for (scenes::Character& character : scene.characters) {
    hold_in_every_frame(character, scene.frame_count);
    character.ignored_hops = options.ignored_hops;
    character.rest_frame = options.rest_frame;
  }

  // People read hits by name, so two characters from files with the same name get different names.
  for (std::size_t c = 1; c < scene.characters.size(); ++c) {
    const std::string base = scene.characters[c].name;
    const auto before = scene.characters.begin() + static_cast<std::ptrdiff_t>(c);
    const auto taken = [&](const scenes::Character& other) { return other.name == scene.characters[c].name; };
    for (int copy = 2; std::any_of(scene.characters.begin(), before, taken); ++copy)
      scene.characters[c].name = base + " (" + std::to_string(copy) + ")";
  }
  if (const std::size_t given = options.offsets.size(); given > 0 && given < scene.characters.size())
    scene.notes.push_back("--offset is given for " + std::to_string(given) + " of " +
                          std::to_string(scene.characters.size()) + " files: it moves " + scene.characters[0].name +
                          (given > 1 ? " to " + scene.characters[given - 1].name : "") +
                          " only; give it again for the next file");
  return scene;
}

}  // namespace cab::perf
