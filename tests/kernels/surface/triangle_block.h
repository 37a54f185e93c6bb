// Sixteen pairs of triangles, and the kernel on them, compiled for each instruction set (triangle_probe.cpp).
#pragma once

#include "kernels/convex/convex_block.h"

namespace cab::tests {

struct alignas(64) TriangleBlock {
  float corner[2][3][3][kLanes];  // of both triangles: corner, coordinate
  float error[kLanes];
  float margin[kLanes];
};

template <class V>
kernel::ConvexAnswer test_triangle_block(const TriangleBlock& block, std::uint32_t active);

}  // namespace cab::tests
