// A block of random pairs of convex shapes, for the verification and for tests of the exact kernels and of the test in
// double.
#pragma once

#include "kernels/convex/convex_block.h"
#include "layout/articulation.h"
#include "layout/convex_shapes.h"
#include "perf/judge/oracle/convex_pairs.h"

#include <cmath>
#include <vector>

namespace cab::perf {

// Sixteen cases as a block, with the shapes that it points at.
struct RandomBlock {
  std::vector<oracle::ConvexCase> cases;
  std::vector<ConvexPart> parts;  // of the cases: a's and b's in turn
  Arena arena{default_allocator()};
  ConvexShapes shapes;
  kernel::ConvexBlock block;

  RandomBlock(oracle::Random& random, oracle::ConvexRegime regime, ShapeKind kind_a, ShapeKind kind_b) {
    for (std::uint32_t i = 0; i < kLanes; ++i) cases.push_back(make_convex_case(random, regime, kind_a, kind_b));
    // What make_convex_shapes reads of an articulation: a leaf for each part.
    std::uint32_t begin[2 * kLanes + 1] = {};
    for (oracle::ConvexCase& one : cases) {
      bind_vertices(one);
      for (const oracle::PosedPart* posed : {&one.a, &one.b}) {
        parts.push_back(posed->part);
        begin[parts.size()] = static_cast<std::uint32_t>(parts.size());
      }
    }
    Articulation articulation;
    articulation.leaf_count = 2 * kLanes;
    articulation.parts = parts;
    articulation.leaf_part_begin = {begin, 2 * kLanes + 1};
    shapes = make_convex_shapes(articulation, arena);
    block.a.coding = block.b.coding = {PoseFormat::kQuaternionTranslation, Scaling::kNone};
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

}  // namespace cab::perf
