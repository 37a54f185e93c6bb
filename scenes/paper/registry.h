// The paper's five scenes by the number of their table.
#pragma once

#include "scenes/scene.h"

#include <array>
#include <cstdint>

namespace cab::scenes {

// What a scene is called and how many frames the paper runs of it.
struct PaperScene {
  std::uint32_t table;
  const char* name;
  std::uint32_t frame_count;
};

// In the order of the tables. Brute force makes 1 200 000 and 288 072 queries in the paper: 10 000 frames of 120 pairs
// of links, and 4001 of 72.
inline constexpr std::array<PaperScene, 5> kPaperScenes = {{
    {1, "chains3", 10000},
    {2, "chains6", 10000},
    {3, "dented", 10000},
    {4, "braid", 10000},
    {5, "hand", 4001},
}};

// Frames 0 .. frame_count - 1 of a table's scene; 0 frames: as many as the paper runs. A shorter scene is a longer
// one's beginning, bit for bit. Throws std::invalid_argument for a number that is no table of the paper.
Scene make_paper_scene(std::uint32_t table, std::uint32_t frame_count = 0);

}  // namespace cab::scenes
