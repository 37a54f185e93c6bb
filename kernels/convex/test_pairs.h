// The exact test of a block of pairs.
#pragma once

#include "kernels/convex/closed_forms.h"
#include "kernels/convex/gjk.h"

namespace cab::kernel {

// The two shapes of each lane.
template <class V>
CAB_INLINE Difference<V> difference_of(const ConvexBlock& block, const PairLanes<V>& pair, std::uint32_t lane) {
  Difference<V> out = {{block.a.shape[0]->kind, pair.size_a, pair.scale_a, {}},
                       {block.b.shape[0]->kind, pair.size_b, pair.scale_b, {}},
                       {pair.column[0], pair.column[1], pair.column[2]},
                       pair.t};
  if (out.a.kind == ConvexKind::kHull) out.a.hulls.find(block.a.shape + lane);
  if (out.b.kind == ConvexKind::kHull) out.b.hulls.find(block.b.shape + lane);
  return out;
}

// The radius of the ball that is added to a shape's segment; 0 for shapes without one.
template <class V>
CAB_INLINE V radius_of(ConvexKind kind, const Vec3<V>& size) {
  return kind == ConvexKind::kRound ? size.x : V(0.0f);
}

// By GJK, for every pair of kinds but half spaces. radius: of both balls, and the margin.
template <class V>
CAB_INLINE ConvexAnswer gjk_pairs(const Difference<V>& difference, const PairLanes<V>& pair, V radius) {
  const V rounding = V(kTetrahedronRounding) * ((pair.reach + sum(abs(pair.t))) * (pair.reach * pair.reach));
  return gjk(GjkPair<V>{pair.t, radius, pair.slack, rounding}, kGjkInFloat, (1u << kWidth<V>)-1,
             [&](const Vec3<V>& d, std::uint32_t active) { return difference.farthest(d, active); });
}

// Tests the sixteen pairs of a block. Lanes that it does not decide need a test in double.
template <class V>
ConvexAnswer test_convex_pairs(const ConvexBlock& block) {
  const ConvexKind kind_a = block.a.shape[0]->kind, kind_b = block.b.shape[0]->kind;
  const bool half_space = kind_a == ConvexKind::kHalfSpace || kind_b == ConvexKind::kHalfSpace;
  const bool closed = kind_a == kind_b && kind_a != ConvexKind::kHull && kind_a != ConvexKind::kCylinder &&
                      (block.margin[0] == 0 || kind_a == ConvexKind::kRound);
  RawSide raw_a, raw_b;
  read_side<V>(block.a, raw_a);
  read_side<V>(block.b, raw_b);
  ConvexAnswer answer;
  for (std::uint32_t lane = 0; lane < kLanes; lane += kWidth<V>) {
    const PairLanes<V> pair = pair_lanes<V>(block, raw_a, raw_b, lane);
    const V margin = Lanes<V>::load(block.scale + lane) * Lanes<V>::load(block.margin + lane);
    ConvexAnswer part;
    if (half_space || !closed) {
      const Difference<V> shapes = difference_of(block, pair, lane);
      const V radius = (radius_of(kind_a, pair.size_a) + radius_of(kind_b, pair.size_b)) + margin;
      part = half_space ? half_space_pairs(shapes, pair.slack, radius) : gjk_pairs(shapes, pair, radius);
    } else if (kind_a == ConvexKind::kRound)
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
