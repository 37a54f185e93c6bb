// Detailed rigs: links in many boxes each, as convex pieces of a mesh are boxed.
#pragma once

#include "scenes/scene.h"

#include <array>
#include <cstdint>

namespace cab::scenes {

// How many boxes a link may be made of; 1 leaves the character as it is.
inline constexpr std::array<std::uint32_t, 7> kBoxesPerLink = {1, 2, 4, 8, 16, 32, 64};

// The character with `count` boxes, one of kBoxesPerLink, in the place of each of its leaves; poses are kept. A leaf's
// box is cut into cells by halving their longest edge, and narrowed as a barrel: at x in -1 .. 1 along its longest axis
// it is sqrt(1 - .6 x^2) times as wide as in the middle. Each cell gets a box 1.15 times as large, so that neighbours
// overlap, rotated about a random axis by up to .2 rad times its least over its greatest half extent, and cut off where
// it would stick out of the leaf's box. The new leaves have no parts: their boxes are their exact shapes. Throws
// std::invalid_argument for another count, and where the character would have more than kMaxLeaves leaves.
Character with_detail(Character character, std::uint32_t count);

}  // namespace cab::scenes
