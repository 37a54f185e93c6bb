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

struct Outline {
  Articulation links;             // leaf i is the box about the leaves of the i-th link that has any; without a tree
  Span<const LinkLeaves> leaves;  // by leaf of `links`
  Span<const BoxTile> tiles;
  bool has_several = false;  // some link has more leaves than one
};

// What a link's box is larger than the boxes in it, as a fraction of its size and of where it is, and what padding and
// margins are multiplied by when it is posed: docs/proof.md, part 6.
inline constexpr double kOutlineGrow = 0x1p-15;
inline constexpr float kOutlinePads = 2;

// Numbers of a posed outline are at most this many times as large as a leaf's may be: part 6.
inline constexpr float kOutlineRange = 4;

// Makes the outline of a built articulation, whose memory it shares. Throws std::bad_alloc.
void build_outline(const Articulation& articulation, Arena& arena, Outline* out);

}  // namespace cab
