// Compares how large inner boxes are by different policies, on figures in some of their poses.
#pragma once

#include <cab/types.h>

#include <cstdint>
#include <vector>

#include "scenes/scene.h"

namespace cab::perf {

// A figure in some poses.
struct PosedFigure {
  scenes::Character figure;  // its poses are those of the sample, [pose][link]
  std::uint32_t pose_count = 0;
  std::vector<float> orientations;  // [pose][4], or empty: no rotation
};

// The sum of the surfaces of all inner boxes of all figures in all poses. 0 if there are no inner boxes.
double inner_area(const std::vector<PosedFigure>& figures, const Policies& policies);

// The same for the smallest boxes about the leaf boxes below each inner node, found by trying orientations
// (perf/judge/oracle/rotation_limit.h).
double inner_area_limit(const std::vector<PosedFigure>& figures);

}  // namespace cab::perf
