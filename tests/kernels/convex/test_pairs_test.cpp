// The exact kernels against the judge of convex shapes: no answer is wrong, few are left open, and all instruction sets
// leave the same open.
#include "kernels/convex/convex_block.h"
#include "layout/articulation.h"
#include "layout/convex_shape.h"
#include "perf/oracle/convex_pairs.h"
#include "tests/kernels/isas.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <cmath>
#include <memory>
#include <vector>

namespace {

using namespace cab;
using namespace cab::tests;
using oracle::ConvexCase;
using oracle::ConvexRegime;
using oracle::JudgedCase;
using oracle::Random;

// Sixteen cases as a block, with the shapes that it points at.
struct Block {
  Arena arena{default_allocator()};
  std::vector<ConvexCase> cases;
  std::vector<Leaf> leaves;
  Articulation articulation;
  ConvexShapes shapes;
  kernel::ConvexBlock block;

  Block(Random& random, ConvexRegime regime, ShapeKind kind_a, ShapeKind kind_b) {
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
    REQUIRE(build_articulation(desc, arena, &articulation, nullptr) == Status::kOk);
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
  Block(const Block&) = delete;
  Block& operator=(const Block&) = delete;
};

}  // namespace

TEST_CASE("no pair of shapes that touches is called apart, none that is apart is called touching, by any kernel") {
  std::uint64_t seed = 0, tested = 0;
  for (unsigned r = 0; r < oracle::kConvexRegimeCount; ++r) {
    const auto regime = static_cast<ConvexRegime>(r);
    std::uint64_t undecided = 0, pairs = 0, wrong_apart = 0, wrong_touching = 0;
    for (const ShapeKind kind_a : oracle::kCaseKinds)
      for (const ShapeKind kind_b : oracle::kCaseKinds)
        for (std::uint64_t round = 0; round < rounds(16); ++round) {
          CAPTURE(++seed);
          Random random(seed);
          const Block made(random, regime, kind_a, kind_b);
          const kernel::ConvexAnswer answer = available_kernels()[0]->test_convex_pairs(made.block);
          for (const kernel::KernelTable* kernels : available_kernels()) {
            CAPTURE(name_of(*kernels));
            const kernel::ConvexAnswer other = kernels->test_convex_pairs(made.block);
            CHECK(other.apart == answer.apart);
            CHECK(other.touching == answer.touching);
          }
          CHECK((answer.apart & answer.touching) == 0);
          for (std::uint32_t lane = 0; lane < kLanes; ++lane, ++pairs) {
            CAPTURE(lane);
            const bool apart = answer.apart >> lane & 1, touching = answer.touching >> lane & 1;
            undecided += !apart && !touching;
            const JudgedCase judged = judge_case(made.cases[lane], oracle::Effort::kDecide);
            wrong_apart += apart && judged.verdict.gap_at_most < 0;
            wrong_touching += touching && judged.verdict.gap_at_least > 0;
          }
        }
    MESSAGE("regime " << r << ": " << undecided << " of " << pairs << " pairs undecided");
    CAPTURE(r);
    CHECK(wrong_apart == 0);
    CHECK(wrong_touching == 0);
    tested += pairs;
    if (regime == ConvexRegime::kRegular || regime == ConvexRegime::kUnits) CHECK(undecided * 100 <= pairs);
  }
  CHECK(tested > 0);
}
