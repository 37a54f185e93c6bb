// Float frames as a pose or a drifting integrator leaves them: orthonormal only to some ulps.
#pragma once

#include "perf/oracle/oracle_box.h"
#include "perf/oracle/random.h"

namespace cab::oracle {

// The largest |R^T R - I| that a box may have (numerics.md, "Bounds").
inline constexpr double kOrthonormalityLimit = 16 * kFloatRoundoff;

// Rounds double axes to the box's float axes.
void set_frame(const double (&axis)[3][3], OracleBox<float>& box);

// Adds noise to float axes that leaves them off orthonormal by 4 u to 16 u.
void drift_frame(Random& random, OracleBox<float>& box);

}  // namespace cab::oracle
