// Crowds that play clips. Each character plays one clip, from its own moment and at its own place.
#pragma once

#include "scenes/crowd/crowd.h"
#include "scenes/import/import.h"
#include "scenes/import/trajectories.h"

#include <cstdint>
#include <functional>
#include <vector>

namespace cab::scenes {

// Returns the place and heading of a character at a time in seconds, 0 or more.
using StandAt = std::function<Standing(std::uint32_t character, double seconds)>;

// A crowd of `count` characters. There is at least one clip; character i plays clip i modulo the number of clips,
// repeatedly and from a random moment. The characters of one clip are one group. A clip is rotated so that its up axis
// becomes z, and the lowest joint of all its frames stands on the ground. `up` is 'x', 'y', 'z', or 0 for the axis
// along which the figure is tallest. The root keeps its height. `stand` gives its path over the ground. The clip's
// direction from first to last frame is rotated to the heading.
Crowd clip_crowd(std::vector<Clip> clips, char up, std::uint32_t count, const StandAt& stand);

}  // namespace cab::scenes
