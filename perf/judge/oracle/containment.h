// The judge of containment: whether a float parent box contains a child box, with all numbers taken as exact reals.
#pragma once

#include "perf/judge/oracle/oracle_box.h"

namespace cab::oracle {

// How far the child's worst corner sticks out of the parent. A negative excess is inside. 0 touches and counts as
// inside.
struct ContainmentVerdict {
  bool inside;         // excess <= 0, up to the judge's own rounding of 2^-100 of the sizes
  double excess;       // max over corners and axes of |x_k| - half[k], in the boxes' unit
  double excess_ulps;  // excess / (2^-24 (S + M)), S and M of the parent
};

// Judges in Quad. x solves A x = corner - center over the parent's skewed axes. Both boxes are in one frame and unit.
// If a box is not finite or has a negative half extent, or if the parent's axes are nearly dependent, the child is
// outside with infinite excess.
ContainmentVerdict judge_containment_exactly(const OracleBox<float>& parent, const OracleBox<Quad>& child);

// The same verdict, but children that are clearly inside are judged in double. Their excess is good to 2^-44 of the
// sizes.
ContainmentVerdict judge_containment(const OracleBox<float>& parent, const OracleBox<float>& child);

// The same for a child in long double, as exact_pose.h poses leaf boxes. The screen is wider here by 2^-46 of the sizes
// and of the child's centre, for the rounding of the child to double.
ContainmentVerdict judge_containment(const OracleBox<float>& parent, const OracleBox<long double>& child);

}  // namespace cab::oracle
