// The two colliding chains of the paper's Tables 1 to 3.
#pragma once

#include "scenes/scene.h"

namespace cab::scenes {

// table is 1 (links 3:1), 2 (links 6:1) or 3 (dented links 6:1 of 12 convex pieces that move as in table 2). Frames
// 0 .. frame_count - 1 at 60 per second; the paper has 10 000. The scene has two characters of 8 links each, which are
// tested against each other. Link frames are centred on their links, and joints lie at the ends of links. Throws
// std::invalid_argument for another table.
Scene make_chains(std::uint32_t table, std::uint32_t frame_count);

}  // namespace cab::scenes
