// The merge program: in which order, and at which joints, leaf boxes become one hierarchy.
#pragma once

#include <cab/types.h>

namespace cab {

class Arena;

// steps[s] makes node leaf_count + s from two earlier nodes; the root is the last. Every node but the root is used
// once. node_leaf_count[n] counts the leaves below node n (1 for a leaf); they are leaf_sequence[node_first_leaf[n]] and
// those after it.
struct MergeProgram {
  Span<const MergeStep> steps;
  Span<const std::uint16_t> node_leaf_count;
  Span<const std::uint16_t> node_first_leaf;
  Span<const std::uint16_t> leaf_sequence;
  std::uint32_t depth = 0;
};

// Builds the balanced program of an articulation whose parents and leaf links are valid. The leaves of one link
// are merged first, in halves, with no joint. Then links: each connected sub-articulation is split at the joint
// that halves its leaves best (ties: the lowest link), so that the two children of a node share that joint.
MergeProgram build_merge_program(Span<const std::int32_t> link_parents, Span<const std::uint16_t> leaf_links,
                                 Arena& arena);

}  // namespace cab
