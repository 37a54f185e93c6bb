// Two people of the CMU motion capture database who touch each other.
#pragma once

#include "scenes/scene.h"

#include <cstdint>

namespace cab::scenes {

// The two are near each other in these frames.
inline constexpr std::uint32_t kFirstCapturedFrame = 1600, kEndCapturedFrame = 2600;

// All frames of two clips of Debian's package assimp-testmodels, placed as `./dev demo` places them. frame_count has no
// effect. Throws std::runtime_error if a file is missing.
Scene make_captured_pair(std::uint32_t frame_count);

}  // namespace cab::scenes
