// The two colliding chains of the paper's Tables 1 and 2.
#pragma once

#include "scenes/scene.h"

namespace cab::scenes {

// table: 1 (links 3:1) or 2 (links 6:1). Frames 0 .. frame_count - 1 at 60 a second, 10 000 in the paper.
// Two characters of 8 links each, link frames centred on their links, joints at the link ends.
// Throws std::invalid_argument for another table.
Scene make_chains(std::uint32_t table, std::uint32_t frame_count);

}  // namespace cab::scenes
