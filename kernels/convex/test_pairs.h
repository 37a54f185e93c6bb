// The exact test of a block of pairs.
#pragma once

#include "kernels/convex/closed_forms.h"
#include "kernels/convex/gjk.h"

namespace cab::kernel {

// The radius of the ball that is added to a shape's segment; 0 for shapes without one.
template <class V>
CAB_INLINE V radius_of(ConvexKind kind, const Vec3<V>& size) {
  return kind == ConvexKind::kRound ? size.x : V(0.0f);
}

// By GJK, for every pair of kinds.
template <class V>
CAB_INLINE ConvexAnswer gjk_pairs(const ConvexBlock& block, const PairLanes<V>& pair, V margin, std::uint32_t lane) {
  const ConvexKind kind_a = block.a.shape[0]->kind, kind_b = block.b.shape[0]->kind;
  const V scale = Lanes<V>::load(block.scale + lane);
  const Difference<V> difference = {{kind_a, pair.size_a, scale, block.a.shape + lane},
                                    {kind_b, pair.size_b, scale, block.b.shape + lane},
                                    {pair.column[0], pair.column[1], pair.column[2]},
                                    pair.t};
  const V radius = (radius_of(kind_a, pair.size_a) + radius_of(kind_b, pair.size_b)) + margin;
  const V rounding = V(kTetrahedronRounding) * ((pair.reach + sum(abs(pair.t))) * (pair.reach * pair.reach));
  return gjk(GjkPair<V>{pair.t, radius, pair.slack, rounding}, kGjkInFloat, (1u << kWidth<V>)-1,
             [&](const Vec3<V>& d, std::uint32_t active) { return difference.farthest(d, active); });
}

// Tests the sixteen pairs of a block. Lanes that it does not decide need a test in double.
template <class V>
ConvexAnswer test_convex_pairs(const ConvexBlock& block) {
  const ConvexKind kind_a = block.a.shape[0]->kind, kind_b = block.b.shape[0]->kind;
  const bool closed =
      kind_a == kind_b && kind_a != ConvexKind::kHull && (block.margin == 0 || kind_a == ConvexKind::kRound);
  RawSide raw_a, raw_b;
  read_side<V>(block.a, raw_a);
  read_side<V>(block.b, raw_b);
  ConvexAnswer answer;
  for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>) {
    const PairLanes<V> pair = pair_lanes<V>(block, raw_a, raw_b, lane);
    const V margin = Lanes<V>::load(block.scale + lane) * V(block.margin);
    ConvexAnswer part;
    if (!closed)
      part = gjk_pairs(block, pair, margin, lane);
    else if (kind_a == ConvexKind::kRound)
      part = round_pairs(pair, margin);
    else if (kind_a == ConvexKind::kBox)
      part = box_pairs(pair);
    else
      part = ellipsoid_pairs(pair, (1u << kWidth<V>)-1);
    answer.apart |= part.apart << lane;
    answer.touching |= part.touching << lane;
  }
  return answer;
}

}  // namespace cab::kernel
