// The second level of an articulation whose links carry several leaves: one box about all leaves of a link.
#pragma once

#include "layout/arena.h"
#include "layout/articulation.h"
#include "layout/tile.h"

namespace cab {

// The leaves of one link. Their boxes stand in tiles, leaves as lanes; lanes past the last repeat it.
struct LinkLeaves {
  std::uint16_t link;
  std::uint16_t leaf_count;
  std::uint32_t first_leaf;  // in the articulation's leaf_order
  std::uint32_t first_tile;
};

struct LinkBounds {
  Articulation links;             // leaf i is the box about the leaves of the i-th link that has any; without a tree
  Span<const LinkLeaves> leaves;  // by leaf of `links`
  Span<const BoxTile> tiles;
  bool has_several_leaves = false;  // some link has more leaves than one
};

// What the half extents of a link's box are larger by than the boxes in it ask: a part of their sum and of how far its
// centre is, for what the leaf predicate's slack and the rounding of posing reach (docs/proof.md, steps 6.3 and 6.5).
inline constexpr double kLinkGrowSize = 0x1.8p-10;       // 1.46e-3; step 6.5: 1.20e-3
inline constexpr double kLinkGrowTranslation = 0x1p-17;  // 128 u; step 6.5: 58 u
// Added to the sum, so that links of points keep some slack, as kOverlapTiny does for the overlap test (step 6.6).
inline constexpr double kLinkTiny = 0x1p-100;

// What padding and margins are multiplied by when a link's box is posed: a leaf's reach sqrt 3 times as far along its
// corners, and both boxes' places are rounded. Step 6.4: 2.61.
inline constexpr float kLinkPads = 2.75f;

// numbers of a posed link box are at most this many times as large as a leaf's may be. Step 6.7: 3.99.
inline constexpr float kLinkRange = 4;

// Makes the link boxes of a built articulation, whose memory it shares. Throws std::bad_alloc.
void build_link_bounds(const Articulation& articulation, Arena& arena, LinkBounds* out);

}  // namespace cab
