// Rigs of many links with one box each, as skeletons of skinned characters have them: a limb with its twist and helper
// joints is several links that move as one.
#pragma once

#include "scenes/crowd/crowd.h"

#include <cstdint>

namespace cab::scenes {

// The group with `link_count` links for each body. Its links have one leaf each, without parts. Each becomes as many
// links as any other, or one more for the first ones: a chain whose boxes are the slices of the link's box across its
// longest axis. A child goes on from the last link of its parent. Throws std::invalid_argument for a count below that
// of the body's links, or above kMaxLinks.
CrowdGroup with_links(CrowdGroup group, std::uint32_t link_count);

// The group with bodies that are `factor` times as large.
CrowdGroup enlarged(CrowdGroup group, float factor);

}  // namespace cab::scenes
