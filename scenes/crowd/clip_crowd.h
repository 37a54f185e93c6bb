// Crowds that play clips: each character plays one of the clips from a moment of its own, at a place of its own.
#pragma once

#include "scenes/crowd/crowd.h"
#include "scenes/import/import.h"
#include "scenes/import/trajectories.h"

#include <cstdint>
#include <functional>
#include <vector>

namespace cab::scenes {

// Where a character is at a time in seconds from 0.
using StandAt = std::function<Standing(std::uint32_t character, double seconds)>;

// `count` characters in a group for each clip that is played, character i in clip i modulo the number of clips (at
// least one), repeated from a random moment on. A clip is set upright, its up axis becoming z (`up`: 'x', 'y', 'z', or
// 0 for the one along which the figure is tallest), with the lowest joint of all its frames on the ground. Its root
// keeps its height; its way over the ground is that of `stand`, and the direction in which the clip gets on as a whole
// is turned into the heading.
Crowd clip_crowd(std::vector<Clip> clips, char up, std::uint32_t count, const StandAt& stand);

}  // namespace cab::scenes
