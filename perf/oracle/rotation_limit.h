// The least surface that a box about given boxes can have, found by trying orientations.
#pragma once

#include <vector>

#include "perf/oracle/oracle_box.h"

namespace cab::oracle {

// The surface of a box, by its half extents.
template <class T>
T surface_of(const T (&half)[3]) {
  return 8 * (half[0] * half[1] + half[1] * half[2] + half[2] * half[0]);
}

// The smallest surface of any oriented box that contains all of the boxes (their axes orthonormal), in the same frame.
// Orientations: the frame's axes, those of every box, and a fixed set of random ones; the best few of them are rotated in
// ever smaller steps for as long as that gains. Always the same answer; the search is no proof, and what it misses is
// below a thousandth on the figures that tests know (tests/perf/oracle/oracle_test.cpp).
double rotation_limit(const std::vector<OracleBox<double>>& boxes);

}  // namespace cab::oracle
