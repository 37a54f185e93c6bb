// A block of random pairs of convex shapes, for tests of the exact kernels and of the test in double.
#pragma once

#include "kernels/convex/convex_block.h"
#include "layout/articulation.h"
#include "layout/convex_shapes.h"
#include "perf/oracle/convex_pairs.h"

#include <cmath>
#include <stdexcept>
#include <vector>

namespace cab::tests {

using oracle::ConvexCase;
using oracle::ConvexRegime;
using oracle::Random;

// Sixteen cases as a block, with the shapes that it points at.
struct RandomBlock {
  Arena arena{default_allocator()};
  std::vector<ConvexCase> cases;
  std::vector<Leaf> leaves;
  Articulation articulation;
  ConvexShapes shapes;
  kernel::ConvexBlock block;

  RandomBlock(Random& random, ConvexRegime regime, ShapeKind kind_a, ShapeKind kind_b) {
    static constexpr std::int32_t kRoot = -1;
    for (std::uint32_t i = 0; i < kLanes; ++i) cases.push_back(make_convex_case(random, regime, kind_a, kind_b));
    for (ConvexCase& one : cases) {
      bind_vertices(one);
      for (const oracle::PosedPart* posed : {&one.a, &one.b}) {
        const float half = kMaxCoordinate;
        leaves.push_back({0, {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {half, half, half}}, {&posed->part, 1}});
      }
    }
    ArticulationDesc desc;
    desc.link_parents = {&kRoot, 1};
    desc.leaves = {leaves.data(), leaves.size()};
    if (build_articulation(desc, arena, &articulation, nullptr) != Status::kOk) throw std::runtime_error("bad case");
    shapes = make_convex_shapes(articulation, arena);
    block.a.format = block.b.format = PoseFormat::kQuaternionTranslation;
    for (std::uint32_t i = 0; i < kLanes; ++i) {
      block.a.shape[i] = &shapes.shapes[2 * i];
      block.b.shape[i] = &shapes.shapes[2 * i + 1];
      block.a.pose[i] = cases[i].a.pose;
      block.b.pose[i] = cases[i].b.pose;
      block.a.orientation[i] = block.b.orientation[i] = nullptr;
      for (std::size_t c = 0; c < 3; ++c) block.shift.by[c][i] = cases[i].shift[c];
      int exponent = 0;
      std::frexp(block.a.shape[i]->reach + block.b.shape[i]->reach, &exponent);
      block.scale[i] = std::ldexp(1.0f, -exponent);
    }
  }
  RandomBlock(const RandomBlock&) = delete;
  RandomBlock& operator=(const RandomBlock&) = delete;
};

}  // namespace cab::tests
