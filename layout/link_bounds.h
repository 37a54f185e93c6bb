// Link bounds, for articulations whose links carry several leaves: one box about all leaves of a link.
#pragma once

#include "layout/articulation.h"

namespace cab {

// The leaves of one link. Their boxes are in tiles with leaves as lanes; lanes past the last leaf repeat it.
struct LinkLeaves {
  std::uint16_t link;
  std::uint16_t leaf_count;
  std::uint32_t first_leaf;  // index in the articulation's leaf_order
  std::uint32_t first_tile;
};

struct LinkBounds {
  Articulation links;             // leaf i is the box about the leaves of the i-th link that has leaves; it has no tree
  Span<const LinkLeaves> leaves;  // by leaf of `links`
  Span<const BoxTile> tiles;
  bool has_several_leaves = false;  // some link has more than one leaf
};

// Makes the link boxes of a built articulation. They also refer to its memory. Throws std::bad_alloc.
void build_link_bounds(const Articulation& articulation, Arena& arena, LinkBounds* out);

}  // namespace cab
