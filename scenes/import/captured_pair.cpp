#include "scenes/import/captured_pair.h"

#include "scenes/import/import.h"

#include <array>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace cab::scenes {
namespace {

struct PlacedClip {
  const char* path;
  std::array<double, 3> offset;  // metres
};
constexpr PlacedClip kClips[] = {{"/usr/share/assimp/models/BVH/01_01.bvh", {0, 0, 0}},
                                 {"/usr/share/assimp/models/BVH/01_03.bvh", {1.3, 0, .4}}};
constexpr double kMetresPerUnit = .0564;

}  // namespace

Scene make_captured_pair(std::uint32_t) {
  std::vector<Clip> clips;
  for (const PlacedClip& placed : kClips) {
    if (!std::filesystem::exists(placed.path))
      throw std::runtime_error(std::string("the scene cmu: there is no ") + placed.path +
                               "; install assimp-testmodels");
    ImportOptions options;
    options.metres_per_unit = kMetresPerUnit;
    options.offset = placed.offset;
    clips.push_back(import_clip(placed.path, options));
  }
  return make_world(std::move(clips));
}

}  // namespace cab::scenes
