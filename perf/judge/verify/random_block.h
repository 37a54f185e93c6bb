// Blocks of pairs of convex shapes, given or random, for the verification and for tests of the exact kernels and of the
// test in double.
#pragma once

#include "kernels/convex/convex_block.h"
#include "layout/articulation.h"
#include "layout/convex_shapes.h"
#include "perf/judge/oracle/convex_pairs.h"

#include <cmath>
#include <vector>

namespace cab::perf {

// Shapes as a block, with all that it points at but vertices. Poses are to be set.
struct ShapeBlock {
  std::vector<ConvexPart> parts;
  Arena arena{default_allocator()};
  ConvexShapes shapes;
  kernel::ConvexBlock block;

  // a_and_b: a's and b's of each lane in turn, or one of each for all lanes.
  explicit ShapeBlock(std::vector<ConvexPart> a_and_b) : parts(std::move(a_and_b)) {
    // What make_convex_shapes reads of an articulation: a leaf for each part.
    std::vector<std::uint32_t> begin;
    for (std::uint32_t i = 0; i <= parts.size(); ++i) begin.push_back(i);
    Articulation articulation;
    articulation.leaf_count = static_cast<std::uint32_t>(parts.size());
    articulation.parts = parts;
    articulation.leaf_part_begin = begin;
    shapes = make_convex_shapes(articulation, arena);
    block.a.coding = block.b.coding = {PoseFormat::kQuaternionTranslation, Scaling::kNone};
    for (std::uint32_t i = 0; i < kLanes; ++i) {
      block.a.shape[i] = &shapes.shapes[2 * i % parts.size()];
      block.b.shape[i] = &shapes.shapes[(2 * i + 1) % parts.size()];
      block.a.orientation[i] = block.b.orientation[i] = nullptr;
      for (auto& by : block.shift.by) by[i] = 0;
      int exponent = 0;
      std::frexp(block.a.shape[i]->reach + block.b.shape[i]->reach, &exponent);
      block.scale[i] = std::ldexp(1.0f, -exponent);
    }
  }
  ShapeBlock(const ShapeBlock&) = delete;
  ShapeBlock& operator=(const ShapeBlock&) = delete;

  void pose(std::uint32_t lane, const float* of_a, const float* of_b) {
    block.a.pose[lane] = of_a;
    block.b.pose[lane] = of_b;
  }
};

// The parts of cases: a's and b's in turn. Binds their vertices.
inline std::vector<ConvexPart> parts_of(std::vector<oracle::ConvexCase>& cases) {
  std::vector<ConvexPart> out;
  for (oracle::ConvexCase& one : cases) {
    bind_vertices(one);
    for (const oracle::PosedPart* posed : {&one.a, &one.b}) out.push_back(posed->part);
  }
  return out;
}

// Sixteen cases as a block.
struct RandomBlock {
  std::vector<oracle::ConvexCase> cases;
  ShapeBlock made;
  kernel::ConvexBlock& block = made.block;

  RandomBlock(oracle::Random& random, oracle::ConvexRegime regime, ShapeKind kind_a, ShapeKind kind_b)
      : cases(random_cases(random, regime, kind_a, kind_b)), made(parts_of(cases)) {
    for (std::uint32_t i = 0; i < kLanes; ++i) {
      made.pose(i, cases[i].a.pose, cases[i].b.pose);
      for (std::size_t c = 0; c < 3; ++c) block.shift.by[c][i] = cases[i].shift[c];
    }
  }

 private:
  static std::vector<oracle::ConvexCase> random_cases(oracle::Random& random, oracle::ConvexRegime regime,
                                                      ShapeKind kind_a, ShapeKind kind_b) {
    std::vector<oracle::ConvexCase> out;
    for (std::uint32_t i = 0; i < kLanes; ++i) out.push_back(make_convex_case(random, regime, kind_a, kind_b));
    return out;
  }
};

}  // namespace cab::perf
