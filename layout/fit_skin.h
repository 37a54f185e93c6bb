// Makes the leaves of a skin: their boxes, and what other links do to them (layout/skinned_leaves.h).
#pragma once

#include "layout/arena.h"
#include "layout/skinned_leaves.h"

namespace cab {

// Checks the skin of an articulation, and makes its leaves with triangles, whose vertices exist. boxes: by leaf;
// receives theirs. Statuses: kBadSkin, with the vertex or link at fault in bad_element; kTooManyInfluences and
// kBadLeafBox, with the leaf. Throws std::bad_alloc.
Status fit_skin(const ArticulationDesc& desc, Arena& arena, Span<Box> boxes, SkinnedLeaves& out,
                std::size_t& bad_element);

}  // namespace cab
