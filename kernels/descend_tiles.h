// Sequences, with frames as lanes: finds the overlapping leaf pairs of two tiles, by descent of both hierarchies or by
// testing all leaf pairs.
#pragma once

#include "kernels/overlap_sat.h"
#include "layout/articulation.h"
#include "layout/compiler.h"
#include "layout/pair_list.h"

namespace cab::kernel {

// What to test: two tiles (Tile is BoxTile or AabbTile), or the links of one tile against each other (self). nodes_a
// and nodes_b hold one Tile per node. shift: the origins of b less the origins of a, or null if they are equal. lanes:
// bits of the instances that take part. `stack` must have room for the sum of both programs' depths + 2, `found` for
// every leaf pair.
template <class Tile>
struct TileDescent {
  const Articulation* articulation_a;
  const Articulation* articulation_b;
  const Tile* nodes_a;
  const Tile* nodes_b;
  const ShiftTile* shift;
  std::uint32_t lanes;
  bool self;
  FixedList<TilePair> stack;
  FixedList<TilePair> found;
  std::uint64_t box_tests;  // counted per live lane
};

// Returns which of the given lanes have two overlapping nodes. A pair of leaves must pass the leaf predicate: the world
// axes and the axes that kSat names.
template <class V, Sat kSat>
CAB_INLINE std::uint32_t overlap_lanes(const BoxTile& a, const BoxTile& b, const ShiftTile* shift, std::uint32_t lanes,
                                       bool leaves) {
  std::uint32_t out = 0;
  for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>) {
    if ((lanes >> lane & ((1u << kWidth<V>)-1)) == 0) continue;
    const BoxLanes<V> box_a = load_box<V>(a, lane), box_b = load_box<V>(b, lane);
    const Vec3<V> between = between_centers(box_a, box_b, shift, lane);
    std::uint32_t apart = 0;
    if (leaves) apart = bits(separated_in_world(box_a, box_b, between));
    if (apart != (1u << kWidth<V>)-1) apart |= bits(separated<kSat>(box_a, box_b, between));
    out |= (~apart & ((1u << kWidth<V>)-1)) << lane;
  }
  return out & lanes;
}

// The same for bounds, which kSat does not affect.
template <class V, Sat>
CAB_INLINE std::uint32_t overlap_lanes(const AabbTile& a, const AabbTile& b, const ShiftTile* shift,
                                       std::uint32_t lanes, bool) {
  std::uint32_t out = 0;
  for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>) {
    const double* x = shift ? shift->by[0] + lane : nullptr;
    const double* y = shift ? shift->by[1] + lane : nullptr;
    const double* z = shift ? shift->by[2] + lane : nullptr;
    out |= (~bits(bounds_apart(load_aabb<V>(a, lane), load_aabb<V>(b, lane), x, y, z)) & ((1u << kWidth<V>)-1)) << lane;
  }
  return out & lanes;
}

// Tests one pair of nodes in the given lanes, and counts the tests.
template <class V, class Tile, Sat kSat>
CAB_INLINE std::uint32_t test_nodes(TileDescent<Tile>& job, std::uint32_t a, std::uint32_t b, std::uint32_t lanes,
                                    bool leaves) {
  job.box_tests += count_bits(lanes);
  return overlap_lanes<V, kSat>(job.nodes_a[a], job.nodes_b[b], job.shift, lanes, leaves);
}

// Descends from one pair of nodes. The node with more leaves is replaced by its children (ties: a). This rule does not
// depend on boxes, so each lane has the same tests as in a descent of its own.
template <class V, class Tile, Sat kSat>
void descend_from(TileDescent<Tile>& job, std::uint32_t root_a, std::uint32_t root_b) {
  const Articulation& art_a = *job.articulation_a;
  const Articulation& art_b = *job.articulation_b;
  const std::uint32_t leaves_a = art_a.leaf_count, leaves_b = art_b.leaf_count;
  job.stack.clear();
  job.stack.push({static_cast<std::uint16_t>(root_a), static_cast<std::uint16_t>(root_b), job.lanes});
  while (!job.stack.empty()) {
    TilePair pair = job.stack.pop();
    const bool leaves = pair.a < leaves_a && pair.b < leaves_b;
    if (leaves && job.self && is_ignored(art_a, art_a.leaf_link[pair.a], art_a.leaf_link[pair.b])) continue;
    if (leaves && job.self && pair.b < pair.a) pair = {pair.b, pair.a, pair.lanes};
    const std::uint32_t lanes = test_nodes<V, Tile, kSat>(job, pair.a, pair.b, pair.lanes, leaves);
    if (!lanes) continue;
    if (leaves) {
      job.found.push({pair.a, pair.b, lanes});
    } else if (art_a.program.node_leaf_count[pair.a] >= art_b.program.node_leaf_count[pair.b]) {
      const MergeStep& step = art_a.program.steps[pair.a - leaves_a];
      job.stack.push({step.right, pair.b, lanes});
      job.stack.push({step.left, pair.b, lanes});
    } else {
      const MergeStep& step = art_b.program.steps[pair.b - leaves_b];
      job.stack.push({pair.a, step.right, lanes});
      job.stack.push({pair.a, step.left, lanes});
    }
  }
}

// Descends both hierarchies at the same time, from the two roots. Within one articulation it descends from the two
// children of every inner node.
template <class V, class Tile, Sat kSat = Sat::kAll15>
void descend_tiles(TileDescent<Tile>& job) {
  if (!job.self)
    return descend_from<V, Tile, kSat>(job, job.articulation_a->node_count - 1, job.articulation_b->node_count - 1);
  for (const MergeStep& step : job.articulation_a->program.steps)
    descend_from<V, Tile, kSat>(job, step.left, step.right);
}

// Tests every leaf of a against every leaf of b; within one articulation, every pair of leaves.
template <class V, class Tile, Sat kSat = Sat::kAll15>
void brute_tiles(TileDescent<Tile>& job) {
  const Articulation& art_a = *job.articulation_a;
  for (std::uint32_t a = 0; a < art_a.leaf_count; ++a) {
    for (std::uint32_t b = job.self ? a + 1 : 0; b < job.articulation_b->leaf_count; ++b) {
      if (job.self && is_ignored(art_a, art_a.leaf_link[a], art_a.leaf_link[b])) continue;
      const std::uint32_t lanes = test_nodes<V, Tile, kSat>(job, a, b, job.lanes, true);
      if (lanes) job.found.push({static_cast<std::uint16_t>(a), static_cast<std::uint16_t>(b), lanes});
    }
  }
}

}  // namespace cab::kernel
