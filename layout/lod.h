// Coarser levels: articulations with the links of a finer one, and fewer leaves that stand for several links each.
#pragma once

#include "layout/articulation.h"

#include <vector>

namespace cab {

// Where the joint of a link is in the frame of its parent.
struct JointPlace {
  double at[3] = {0, 0, 0};
  double play = 0;  // how far from there it may be
};

// Builds a level of boxes on links that hold whatever the links that they stand for can reach (docs/proof.md, part 10).
// joints: by link of `fine`, which is no level. desc.of, kind and poses are the caller's to check. On an error *out is
// unchanged, and *bad_leaf (if not null) receives the index of the caller's leaf at fault. Throws std::bad_alloc.
Status build_reach_lod(const Articulation& fine, const LodDesc& desc, const std::vector<JointPlace>& joints,
                       Arena& arena, Articulation* out, std::uint32_t* bad_leaf);

// Builds a level of at most `max_leaves` nodes of the hierarchy of `fine`, which must outlive it. Throws
// std::bad_alloc.
Status build_node_lod(const Articulation& fine, std::uint32_t max_leaves, Arena& arena, Articulation* out);

}  // namespace cab
