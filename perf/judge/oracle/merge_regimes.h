// Random pairs of child boxes, by regimes that are hard for a merge in float.
#pragma once

#include <functional>
#include <vector>

#include "perf/judge/oracle/merge_cab_double.h"
#include "perf/judge/oracle/oracle_box.h"
#include "perf/judge/oracle/random.h"

namespace cab::oracle {

// The regimes. docs/numerics.md, "Verification", has the results of most. Lengths are in metres.
enum class MergeRegime {
  kLimbs,         // length to thickness 1:1 to 6:1, any joint angle
  kStraight,      // limbs bent by 1e-7 to 0.1 rad
  kFolded,        // limbs folded onto each other to 1e-7 to 0.1 rad
  kHighAspect,    // aspect 1e3 to 1e6
  kDegenerate,    // plates, segments and points, against each other and against limbs
  kTinyHuge,      // one child 1e2 to 1e12 times as large as the other
  kFar,           // 1e5 to 1e7 m from the origin
  kExtremeScale,  // both children, or one child alone, scaled by 1e-30 to 1e18
  kDrifting,      // axes as far from orthonormal as the kernels' may be
  kParents,       // children that are parents themselves, one to four levels up
};
inline constexpr unsigned kMergeRegimeCount = 10;

// One merge to try. A fifth of the cases have no joint.
struct MergeCase {
  OracleBox<float> child1, child2;
  bool has_joint;
  float joint[3];
};

// Makes the parent of two boxes; joint points to x, y, z or is null.
using ParentMaker =
    std::function<OracleBox<float>(const OracleBox<float>&, const OracleBox<float>&, const float* joint)>;

// The oracle's own parent, padded and rounded to float.
OracleBox<float> oracle_parent(const OracleBox<float>& child1, const OracleBox<float>& child2, const float* joint);

// A random case of a regime. make_parent makes the children of kParents from leaves.
MergeCase make_merge_case(Random& random, MergeRegime regime, const ParentMaker& make_parent = oracle_parent);

// Every parent that the oracle accepts for a case, the prescribed one first.
std::vector<OracleMerge> merge_cab_candidates(const MergeCase& merge_case, const MarginThresholds& thresholds = {});

}  // namespace cab::oracle
