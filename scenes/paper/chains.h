// The two colliding chains of the paper's Tables 1 to 3.
#pragma once

#include "scenes/scene.h"

namespace cab::scenes {

// table: 1 (links 3:1), 2 (links 6:1) or 3 (dented links 6:1 of 12 convex pieces, moving as in 2). Frames
// 0 .. frame_count - 1 at 60 a second, 10 000 in the paper. Two characters of 8 links each, link frames centred on
// their links, joints at the link ends, tested against each other. Throws std::invalid_argument for another table.
Scene make_chains(std::uint32_t table, std::uint32_t frame_count);

}  // namespace cab::scenes
