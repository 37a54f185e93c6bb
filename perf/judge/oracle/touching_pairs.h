// Pairs of float boxes that are hard for an overlap test.
#pragma once

#include "perf/judge/oracle/oracle_box.h"
#include "perf/judge/oracle/random.h"

namespace cab::oracle {

// Two boxes, each relative to the origin of its instance; the origins share one world frame, in metres.
struct BoxPair {
  OracleBox<float> a, b;
  double origin_a[3], origin_b[3];
};

// What makes a nearly touching pair hard.
enum class TouchRegime {
  kOrdinary,           // halves within a factor of 10 of each other
  kHighAspect,         // longest over shortest half to 1e6
  kPlates,             // one or both without thickness
  kLines,              // a segment against a solid, a plate, or another segment on its line
  kPoints,             // a point against a solid, a plate, a segment or a point
  kTinyHuge,           // one box 1e2 to 1e6 times as large as the other
  kParallelEdges,      // one axis in common, bit for bit, or all three
  kNearParallelEdges,  // frames rotated by 1e-8 to 1e-2
  kFarCenters,         // centres 10 to 1e4 sizes from their common origin
  kFarOrigins,         // instances 1e5 to 1e7 m from the world's origin, centres within metres of their own origins
  kOneAxis,            // one of the 15 axes alone decides
  kExtremeScale,       // sizes 1e-30 to 1e18
};
inline constexpr unsigned kTouchRegimeCount = 12;

// A pair whose signed gap is about gap_ulps times 2^-24 (Sa + Sb), within about one ulp (6 in kHighAspect). Boxes with
// a negative gap overlap; judge_overlap tells. Origins are zero except in kFarOrigins; half of the frames drift as far
// as the kernels' may. A fifth of kLines and a third of kPoints have no thickness to overlap by: they touch exactly,
// whatever gap_ulps is.
BoxPair near_touching_pair(Random& random, TouchRegime regime, double gap_ulps);

// B's centre minus A's in the world frame, exact to Quad.
Vec3<Quad> exact_offset(const BoxPair& pair);

// A pose, origins zero, that only axis k in 0..14 of the judge separates, by 3 % of Sa + Sb; sizes about 1 m.
BoxPair separating_axis_pose(std::size_t k);

}  // namespace cab::oracle
