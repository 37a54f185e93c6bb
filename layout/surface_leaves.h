// The triangles of leaves, as the exact test of surfaces reads them. layout/list_surface.h makes what is here.
//
// Vertices of a leaf are in blocks of sixteen, triangles in patches of up to sixteen that are next to each other. A
// vertex that several leaves have is in each of them.
#pragma once

#include "layout/tile.h"

#include <cab/types.h>

namespace cab {

// Sixteen vertices of a leaf as lanes. The last block of a leaf repeats its last vertex.
struct alignas(64) VertexBlock {
  float place[3][kLanes];         // in the skin's frame
  std::uint32_t vertex[kLanes];   // index in the skin
  std::uint32_t influence_begin;  // of SurfaceLeaves::influences
  std::uint32_t influence_count;
};

// What one link does to the vertices of a block.
struct alignas(64) BlockInfluence {
  float weight[kLanes];  // those of a vertex add to 1, to rounding
  std::uint32_t bone;    // which of the leaf's bones
};

// A link that moves vertices of a leaf.
struct SurfaceBone {
  std::uint32_t link;
  float bind[4][3];  // the columns of the link's inverse bind matrix
  float reach;       // no number on the way of these vertices to the link's frame is larger
  float radius;      // none of them is farther from the link's origin
};

// Up to sixteen triangles that are next to each other.
struct TrianglePatch {
  std::uint32_t corner[3][kLanes];  // of each triangle: kLanes times the vertex's block, and its lane
  std::uint32_t triangle[kLanes];   // index in Leaf::triangles, over 3
  std::uint32_t count;              // of triangles; the last one is repeated
};

// Of one leaf.
struct SurfaceLeaf {
  std::uint32_t bone_begin, bone_count;
  std::uint32_t block_begin, block_count;
  std::uint32_t patch_begin, patch_count;    // no patches: the leaf has no triangles
  std::uint32_t bounds_begin, bounds_count;  // no bounds: not one link alone moves the leaf, in its frame
};

// What an articulation has of its skin besides the boxes (layout/skinned_leaves.h).
struct SurfaceLeaves {
  Span<const SurfaceLeaf> leaves;  // by leaf, or none if no leaf has triangles
  Span<const SurfaceBone> bones;
  Span<const VertexBlock> blocks;
  Span<const BlockInfluence> influences;
  Span<const TrianglePatch> patches;
  // Of leaves that one link moves, in whose frame their vertices are: bounds there, as SkinnedLeaf::bounds has them.
  // And the vertices of all leaves: x y z 0 of each, in the order of blocks.
  Span<const AabbTile> bounds;
  Span<const float> places;
  std::uint32_t most_blocks = 0, most_patches = 0, most_bones = 0;  // of one leaf
  // The skin as the caller has given it, for double. inverse_bind: 16 floats per link, or none.
  Span<const float> vertices;
  std::uint32_t influence_count = 0;
  Span<const std::uint32_t> influence_links;
  Span<const float> influence_weights;
  Span<const float> inverse_bind;
};

}  // namespace cab
