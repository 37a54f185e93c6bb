// The humanoid of crowds with a skin, whose boxes grow with the poses of its links.
#pragma once

#include "scenes/crowd/crowd.h"

#include <cstdint>

namespace cab::scenes {

// The leaves of a humanoid with a skin, and its triangles.
inline constexpr std::uint32_t kSkinLeaves = 44, kSkinTriangles = 44 * 112;

// A group of humanoids with a skin: an open tube about the box of each link, across its longest axis, in two or three
// leaves one after the other. Its vertices near the joint with the parent are also moved by that, and near a child's
// joint by the child, each at most by half. With SkinLeafKind::kRigid the leaves are their boxes alone, as the link of
// each would move them.
CrowdGroup with_skin(CrowdGroup humanoids, SkinLeafKind leaves);

}  // namespace cab::scenes
