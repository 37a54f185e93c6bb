// Compiled once per instruction set, like the kernels: CAB_ISA is its name.
#include "kernels/isa_vector.h"
#include "kernels/surface/test_triangles.h"
#include "tests/kernels/surface/triangle_block.h"

namespace cab::tests {

template <class V>
kernel::ConvexAnswer test_triangle_block(const TriangleBlock& block, std::uint32_t active) {
  kernel::ConvexAnswer answer;
  for (std::uint32_t lane = 0; lane < kLanes; lane += kernel::kWidth<V>) {
    kernel::TriangleLanes<V> side[2];
    for (int s = 0; s < 2; ++s)
      for (int k = 0; k < 3; ++k) side[s].corner[k] = kernel::load3<V>(block.corner[s][k], lane);
    const std::uint32_t part_active = active >> lane & ((1u << kernel::kWidth<V>)-1);
    const kernel::ConvexAnswer part =
        kernel::test_triangles(side[0], side[1], kernel::Lanes<V>::load(block.error + lane),
                               kernel::Lanes<V>::load(block.margin + lane), part_active);
    answer.apart |= part.apart << lane;
    answer.touching |= part.touching << lane;
  }
  return answer;
}

template kernel::ConvexAnswer test_triangle_block<kernel::IsaVector>(const TriangleBlock&, std::uint32_t);

}  // namespace cab::tests
