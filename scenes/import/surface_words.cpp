// What became of a surface, in words for notes.
#include "scenes/import/surface_words.h"

namespace cab::scenes {

std::string counted(std::uint64_t count, const char* one, const char* several) {
  return std::to_string(count) + " " + (count == 1 ? one : several);
}

std::string triangle_words(const rig::SurfaceInfo& info, std::size_t leaf_count) {
  return counted(info.triangle_count, "triangle", "triangles") + " in " + counted(leaf_count, "leaf", "leaves") +
         " of " + counted(info.link_count, "link", "links");
}

std::string part_words(const rig::SurfaceInfo& info) {
  std::string words = counted(info.part_count, "part", "parts");
  if (info.open_part_count > 0)
    words += ", " + std::to_string(info.open_part_count) + " of them open (" +
             counted(info.open_edge_count, "edge", "edges") + "; a body wholly inside these is not found)";
  return words;
}

}  // namespace cab::scenes
