// Leaves of a skin: boxes on one link, about vertices that other links move too. Such a box grows with the poses of
// these links, so that it holds its vertices without skinning them (kernels/grow_leaves.h). layout/fit_skin.h makes
// what is here.
//
// The skin is one of linear blends. A vertex is at the sum over its links i of w_i T_i B_i v: its weights add to 1, T_i
// is the pose of link i, and B_i takes points of the skin to that link, as in the pose in which links were bound to it.
//
// A leaf's own coordinates y are along the axes of its box, about the box's centre, in half extents: vertices have
// |y_k| <= 1, and 0 where the box is flat.
#pragma once

#include "layout/tile.h"

#include <cab/types.h>

namespace cab {

// What another link does to the vertices of a leaf.
struct LeafInfluence {
  std::uint32_t relative;  // which of SkinnedLeaves::relatives of the leaf's link
  // The leaf's box in the frame of the other link, when that was bound: its centre and half edges.
  float center[3];
  float edge[3][3];
  float size;  // |center|_1 + the sum of |edge|_1
  // The link's weight at y is weight + slope . y, to within slack.
  float weight, slope[3], slack;
  // The box of (w - weight) y.
  float bent_center[3], bent_half[3];
  // The box of the vertices that the link moves.
  float moved_center[3], moved_half[3];
  float gain;  // how much the roundings of where the link is may grow
};
static_assert(sizeof(LeafInfluence) == 128);

// The vertices of a leaf that its own link moves: their box, along the axes of the leaf's about its centre, in lengths.
struct OwnVertices {
  float center[3], half[3];
};

// The most links that move a leaf besides its own.
inline constexpr std::uint32_t kMaxInfluences = 32;

// Sixteen leaves as lanes, to grow the boxes of one instance. Those with most influences come first; the last block
// repeats its last leaf. `rounds` is how many influences the first leaf has.
struct alignas(64) LeafLanes {
  float axis[3][3][kLanes], center[3][kLanes], half[3][kLanes];  // as in BoxTile
  float own_center[3][kLanes], own_half[3][kLanes];              // OwnVertices
  std::uint16_t leaf[kLanes], link[kLanes];
  std::uint32_t first_round, rounds;  // of SkinnedLeaves::rounds
};

// One influence of each leaf of a block.
struct alignas(64) InfluenceLanes {
  float value[sizeof(LeafInfluence) / sizeof(float)][kLanes];  // by place in LeafInfluence
  float is_there[kLanes];                                      // 1, or 0 where a leaf has fewer
  std::uint32_t relative[kLanes];                              // index in SkinnedLeaves::relatives
};

// What an articulation has of its skin.
struct SkinnedLeaves {
  Span<const std::uint16_t> relatives;        // links that are looked at from another, by that one
  Span<const std::uint16_t> relative_from;    // by relative: that other link
  Span<const std::uint32_t> relative_begin;   // by link, where its own begin; then the end
  std::uint32_t most_relatives = 0;           // of one link
  Span<const LeafInfluence> influences;       // by leaf
  Span<const std::uint32_t> influence_begin;  // by leaf; then the end
  Span<const OwnVertices> own;                // by leaf; not read of those without influences
  Span<const LeafLanes> lanes;                // all leaves, each once but for the last
  Span<const InfluenceLanes> rounds;

  bool empty() const { return influences.empty(); }
};

}  // namespace cab
