// What became of a surface, in words for notes.
#pragma once

#include <cab/skin.h>

#include <cstddef>
#include <string>

namespace cab::scenes {

// "1 leaf", "2 leaves".
std::string counted(std::uint64_t count, const char* one, const char* several);

// "4672 triangles in 44 leaves of 19 links".
std::string triangle_words(const rig::SurfaceInfo& info, std::size_t leaf_count);

// "3 parts, 2 of them open (40 edges)".
std::string part_words(const rig::SurfaceInfo& info);

}  // namespace cab::scenes
