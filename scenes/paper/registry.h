// The paper's five scenes by the number of their table.
#pragma once

#include "scenes/paper/braid.h"
#include "scenes/paper/chains.h"
#include "scenes/paper/hand.h"
#include "scenes/scene.h"

#include <array>
#include <cstdint>

namespace cab::scenes {

struct PaperScene {
  std::uint32_t table;
  const char* name;
  const char* meaning;        // one line
  std::uint32_t frame_count;  // how many frames the paper runs
  Scene (*make)(std::uint32_t frame_count);
};

template <std::uint32_t kTable>
Scene make_chains_of(std::uint32_t frame_count) {
  return make_chains(kTable, frame_count);
}

// In the order of the tables. Brute force makes 1 200 000 queries in Tables 1 to 4 of the paper, 10 000 frames of 120
// pairs of links, and 288 072 in Table 5, 4001 frames of 72 pairs.
inline constexpr std::array<PaperScene, 5> kPaperScenes = {{
    {1, "chains3", "table 1 of the paper: two chains that collide, links 3:1", 10000, make_chains_of<1>},
    {2, "chains6", "table 2 of the paper: two such chains, links 6:1", 10000, make_chains_of<2>},
    {3, "dented", "table 3 of the paper: two chains of links that are not convex", 10000, make_chains_of<3>},
    {4, "braid", "table 4 of the paper: two strands wound about each other", 10000, make_braid},
    {5, "hand", "table 5 of the paper: a hand flicks a ball", 4001, make_hand},
}};

// Makes frames 0 .. frame_count - 1 of a table's scene. A frame_count of 0 means as many as the paper runs. A
// short scene is the beginning of a long one, bit for bit. Throws std::invalid_argument if the paper has no such table.
Scene make_paper_scene(std::uint32_t table, std::uint32_t frame_count = 0);

}  // namespace cab::scenes
