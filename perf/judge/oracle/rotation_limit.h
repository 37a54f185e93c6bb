// The least surface that a box about given boxes can have, found by trying orientations.
#pragma once

#include <vector>

#include "perf/judge/oracle/oracle_box.h"

namespace cab::oracle {

// The surface of a box, by its half extents.
template <class T>
T surface_of(const T (&half)[3]) {
  return 8 * (half[0] * half[1] + half[1] * half[2] + half[2] * half[0]);
}

// The smallest surface found of an oriented box that contains all of the boxes (their axes orthonormal), in the same
// frame. The search starts from the frame's axes, the axes of every box and a fixed set of random orientations; the
// best few are rotated in ever smaller steps while that shrinks the surface. The answer is always the same. The search
// is no proof: on figures with a known optimum it is within a thousandth (tests/perf/judge/oracle/oracle_test.cpp).
double rotation_limit(const std::vector<OracleBox<double>>& boxes);

}  // namespace cab::oracle
