// An articulation as the engine keeps it: plain data in one arena, immutable, and shared by all its instances.
#pragma once

#include "layout/merge_program.h"
#include "layout/skinned_leaves.h"
#include "layout/surface_leaves.h"
#include "layout/surface_parts.h"

#include <cab/types.h>

namespace cab {

// A link that a frame must pose, because it carries leaves or moves a skin, or because a merge needs its joint. Its
// leaves are leaf_order[leaf_begin] to leaf_order[leaf_end - 1].
struct PosedLink {
  std::uint16_t link;
  std::uint16_t leaf_begin;
  std::uint16_t leaf_end;
  bool needs_joint;
};

struct Articulation;

// What an articulation that is a coarser level has in addition (LodDesc).
struct Lod {
  Span<const std::uint16_t> leaf_of_link;  // by link: the leaf that stands for it, kNoLeaf without leaves; or empty
  std::uint32_t finest_leaves = 0;         // of the articulation that this is a level of
  // Of a level of nodes: the articulation whose leaves are posed, and by node of the level its node there, ascending
  // among leaves and among inner nodes.
  const Articulation* posed = nullptr;
  Span<const std::uint16_t> node;
};

struct Articulation {
  std::uint32_t link_count = 0;
  std::uint32_t leaf_count = 0;
  std::uint32_t node_count = 0;
  Span<const std::int32_t> link_parent;
  Span<const float> link_joint;  // 3 floats per link, in the link's frame
  Span<const std::uint16_t> leaf_link;
  Span<const Box> leaf_box;  // in the link's frame, axes orthonormal to kAxesExact
  Span<const PosedLink> posed_links;
  Span<const std::uint16_t> leaf_order;    // leaves grouped by link
  bool is_chain = false;                   // no link has two children
  bool leaves_by_link = false;             // each link has at most one leaf, and leaves are in the order of links
  Span<const IgnoredPair> ignored_pairs;   // sorted by a, then b; each once
  Span<const std::uint64_t> ignored_bits;  // bit a * link_count + b: is_ignored(a, b)
  std::uint64_t leaf_pairs_within = 0;     // of one instance, on links that are not ignored (count_leaf_pairs_within)
  // The vertices of each leaf's exact shape, x y z in the link's frame: the vertices of its hulls, and the eight
  // corners of the box about every other part. For a leaf without parts and for a half space that is the leaf's box.
  // leaf_vertex_reach: the largest |x| + |y| + |z| of a leaf's vertices.
  Span<const float> vertices;
  Span<const std::uint32_t> leaf_vertex_begin;  // leaf_count + 1 indices of vertices
  Span<const float> leaf_vertex_reach;
  Span<const ConvexPart> parts;
  Span<const std::uint32_t> leaf_part_begin;  // leaf_count + 1 indices into parts
  SkinnedLeaves skin;                         // or nothing
  SurfaceLeaves surface;                      // likewise
  SurfaceParts surface_parts;                 // likewise
  MergeProgram program;
  Lod lod;
};

// Whether the leaves are boxes with room for whatever their links can reach.
inline bool is_reach_lod(const Articulation& articulation) {
  return !articulation.lod.leaf_of_link.empty() && !articulation.lod.posed;
}

// The articulation whose leaves are posed for another's boxes: that itself, unless it is a level of nodes.
inline const Articulation& posed_articulation(const Articulation& articulation) {
  return articulation.lod.posed ? *articulation.lod.posed : articulation;
}

// How many tiles a skin takes while it is posed: where each link is, and where others are seen from one link.
inline std::size_t skin_tiles(const Articulation& articulation) {
  return articulation.skin.empty() ? 0 : std::size_t{articulation.link_count} + articulation.skin.most_relatives;
}

// How many rows of sixteen floats the growth of one instance's boxes takes: one for each link, and one for each link as
// another sees it, of these a multiple of sixteen.
inline std::size_t skin_rows(const Articulation& articulation) {
  if (articulation.skin.empty()) return 0;
  return articulation.link_count +
         std::size_t{kLanes} * tile_count(static_cast<std::uint32_t>(articulation.skin.relatives.size));
}

// Whether leaves have triangles of a skin.
inline bool has_skin(const Articulation& articulation) { return !articulation.skin.own.empty(); }

// Returns whether links a and b of one instance are never reported as a pair: they are the same link or an ignored
// pair.
inline bool is_ignored(const Articulation& articulation, std::uint32_t a, std::uint32_t b) {
  const std::size_t bit = static_cast<std::size_t>(a) * articulation.link_count + b;
  return (articulation.ignored_bits[bit >> 6] >> (bit & 63)) & 1;
}

// How many pairs of leaves of one instance are tested.
std::uint64_t count_leaf_pairs_within(const Articulation& articulation);

// The leaves of a link, ascending.
Span<const std::uint16_t> leaves_of(const Articulation& articulation, std::uint32_t link);

// Checks desc and copies it into the arena, without its rest pose. On an error *out is unchanged, and *bad_element (if
// not null) receives the index of the link, leaf or ignored pair at fault. Throws std::bad_alloc.
Status build_articulation(const ArticulationDesc& desc, Arena& arena, Articulation* out, std::uint32_t* bad_element);

// Checks leaves of one link, any number of them, and copies them into the arena: sets leaf_count, leaf_link, leaf_box,
// parts and leaf_part_begin. Errors are those of build_articulation. Throws std::bad_alloc.
Status build_leaves(Span<const Leaf> leaves, Arena& arena, Articulation* out, std::uint32_t* bad_leaf);

// Writes the rotation of a unit quaternion x y z w: columns[k] is the image of axis k. Returns false if the quaternion
// is not of unit length, to the tolerance of ConvexPart::rotation.
bool rotation_columns(const float* q, double columns[3][3]);

// Makes these pairs of links the ignored pairs of an articulation, whose memory `arena` owns. Throws std::bad_alloc.
void ignore_pairs(Span<const LinkPair> pairs, Arena& arena, Articulation& articulation);

// Adds the pairs of links that touch in the rest pose to the ignored pairs of an articulation, whose memory `arena`
// owns. `touching` may hold a pair more than once and in either order. Throws std::bad_alloc.
void ignore_at_rest(Span<const LinkPair> touching, Arena& arena, Articulation& articulation);

}  // namespace cab
