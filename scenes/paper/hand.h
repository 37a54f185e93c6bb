// The hand of the paper's Table 5, which flicks a ball on a table between two rails.
#pragma once

#include "scenes/scene.h"

#include <cstdint>

namespace cab::scenes {

// Makes frames 0 .. frame_count - 1 at 60 per second; the paper's 288 072 pairs are 4001 frames. Lengths are
// centimetres. The characters are the hand, the ball, the table and two rails; the last three are static. The hand has
// 18 bodies: forearm, palm, thumb metacarpal, then three phalanges each of thumb, index, middle, ring and little
// finger. The hand is tested against each of the other four. These are not tested against each other, because the ball
// always touches the table.
Scene make_hand(std::uint32_t frame_count);

}  // namespace cab::scenes
