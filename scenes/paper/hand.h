// The hand of the paper's Table 5, which flicks a ball on a table between two rails.
#pragma once

#include "scenes/scene.h"

#include <cstdint>

namespace cab::scenes {

// In centimetres. Frames 0 .. frame_count - 1 at 60 a second; the paper's 288 072 pairs are 4001 frames.
// Characters: the hand (forearm, palm, thumb metacarpal, then three phalanges each of the thumb, index, middle, ring and
// little finger: 18 bodies), the ball, the table, and two rails. The last three are static. The hand is tested
// against each of the four others; these are not tested against each other (the ball always touches the table).
Scene make_hand(std::uint32_t frame_count);

}  // namespace cab::scenes
