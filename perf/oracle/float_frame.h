// Float frames as a pose or a drifting integrator leaves them: orthonormal only to some ulps.
#pragma once

#include "perf/oracle/oracle_box.h"
#include "perf/oracle/random.h"

namespace cab::oracle {

// What the kernels leave at most of axes A0, A1, A2 (docs/proof.md, part 1): the squared length of A0 and of A1 less 1,
// A0 . A1, and e = A2 - A0 x A1 along A0 or A1, and along A2.
inline constexpr double kSquareLimit = 9.1 * kFloatRoundoff;
inline constexpr double kCosineLimit = 4.6 * kFloatRoundoff;
inline constexpr double kCrossLimit = 2.2 * kFloatRoundoff;
inline constexpr double kCrossLengthLimit = 2.3 * kFloatRoundoff;

// What follows for |R^T R - I|: 2 kSquareLimit + 2 kCrossLengthLimit, of the length of A2.
inline constexpr double kOrthonormalityLimit = 23 * kFloatRoundoff;

// The largest of those four errors, each as a part of its limit: a frame of the kernels has at most 1.
double frame_error(const OracleBox<float>& box);

// Rounds double axes to the box's float axes.
void set_frame(const double (&axis)[3][3], OracleBox<float>& box);

// Adds noise to float axes until their frame_error is between a quarter and 1.
void drift_frame(Random& random, OracleBox<float>& box);

}  // namespace cab::oracle
