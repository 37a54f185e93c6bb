// Axes in float as a pose or a drifting integrator leaves them: orthonormal only to some ulps.
#pragma once

#include "perf/judge/oracle/oracle_box.h"
#include "perf/judge/oracle/random.h"

namespace cab::oracle {

// The largest errors of the axes A0, A1, A2 that kernels make (docs/proof.md, part 1): of the squared lengths of A0 and
// A1, of A0 . A1, and of e = A2 - A0 x A1 along A0 or A1, and along A2.
inline constexpr double kSquareLimit = 9.1 * kFloatRoundoff;
inline constexpr double kCosineLimit = 4.6 * kFloatRoundoff;
inline constexpr double kCrossLimit = 2.2 * kFloatRoundoff;
inline constexpr double kCrossLengthLimit = 2.3 * kFloatRoundoff;

// The limit that follows for |R^T R - I|: 2 kSquareLimit + 2 kCrossLengthLimit, from the length of A2.
inline constexpr double kOrthonormalityLimit = 23 * kFloatRoundoff;

// The largest of those four errors, each as a share of its limit: at most 1 for axes that kernels make.
double frame_error(const OracleBox<float>& box);

// Rounds double axes to the box's float axes.
void set_frame(const double (&axis)[3][3], OracleBox<float>& box);

// Adds noise to float axes until their frame_error is between a quarter and 1.
void drift_frame(Random& random, OracleBox<float>& box);

}  // namespace cab::oracle
