// The merge program: the order in which leaf boxes become one hierarchy, and the joint of each merge.
#pragma once

#include <cab/types.h>

namespace cab {

class Arena;

// steps[s] makes node leaf_count + s from two earlier nodes. The root is the last node. Every other node is the child
// of one node. node_leaf_count[n] counts the leaves below node n (1 for a leaf). They are in leaf_sequence from
// node_first_leaf[n] on. depth: merges on the longest path from the root to a leaf.
struct MergeProgram {
  Span<const MergeStep> steps;
  Span<const std::uint16_t> node_leaf_count;
  Span<const std::uint16_t> node_first_leaf;
  Span<const std::uint16_t> leaf_sequence;
  std::uint32_t depth = 0;
};

// Builds the balanced program of an articulation whose parents and leaf links are valid. The leaves of one link are
// merged first, in halves, without a joint. Then links are merged: each connected sub-articulation is split at the
// joint that halves its leaves best (ties: the lowest link), so the two children of a node share that joint.
MergeProgram build_merge_program(Span<const std::int32_t> link_parents, Span<const std::uint16_t> leaf_links,
                                 Arena& arena);

}  // namespace cab
