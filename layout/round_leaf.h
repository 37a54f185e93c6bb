// Balls and capsules as leaves, for the kernel that tests sequences of bodies that have no others.
#pragma once

#include "layout/tile.h"

#include <cab/span.h>

namespace cab {

// No length of a round body or its poses is beyond this, so that squares of sums stay finite.
inline constexpr float kMostRoundLength = 1e9f;

// All points within `radius` of a segment, in the link's frame: from center - axis to center + axis.
struct RoundLeaf {
  float center[3];
  float axis[3];  // half of the segment; 0 of a ball
  float radius;
  float size;          // |x| + |y| + |z| of center and axis, summed
  float reach;         // no point of the leaf is farther from its centre
  std::uint16_t leaf;  // its index in the articulation
  bool is_ball;
};

// A link with leaves: leaves[begin] to leaves[end - 1]. ball: about all of them; not read of a link with one leaf.
struct RoundLink {
  std::uint16_t link, begin, end;
  RoundLeaf ball;
};

// Empty unless all leaves of an articulation are round. Leaves ascend within their link.
struct RoundBody {
  Span<const RoundLeaf> leaves;
  Span<const RoundLink> links;  // in the order of Articulation::posed_links
  bool has_capsules = false;    // whether a leaf is no ball
};

// A posed leaf, one instance per lane.
struct alignas(64) RoundTile {
  float center[3][kLanes];
  float axis[3][kLanes];
  float size[kLanes];  // RoundLeaf::size, and that of the link's translation
};

}  // namespace cab
