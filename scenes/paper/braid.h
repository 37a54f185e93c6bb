// The braided chains of the paper's Table 4.
#pragma once

#include "scenes/scene.h"

#include <cstdint>

namespace cab::scenes {

// Two strands of 8 links of ratio 6:1 that wind about each other. Frames 0 .. frame_count - 1 at 60 a second, 10 000 in
// the paper. Link frames are centred on their links, joints at the link ends. The strands are tested against each
// other.
Scene make_braid(std::uint32_t frame_count);

}  // namespace cab::scenes
