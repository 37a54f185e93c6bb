// The 58-vertex superellipsoid polytope that the paper's links are made of.
#pragma once

#include <cmath>
#include <vector>

namespace cab::scenes {

// sign(x) |x|^e
inline double spow(double x, double e) { return std::copysign(std::pow(std::fabs(x), e), x); }

// x y z of the 58 vertices of a polytope with half extents (a, b, c) along x, y, z: the two poles (-+a, 0, 0), then
// seven rings of eight. e = 1 gives an ellipsoid; a small e approaches a box. Computed in double and rounded once.
std::vector<float> superellipsoid(double a, double b, double c, double e);

}  // namespace cab::scenes
