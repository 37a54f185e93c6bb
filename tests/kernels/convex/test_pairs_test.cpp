// The exact kernels against the judge of convex shapes: no answer is wrong, few are left open, and all instruction sets
// leave the same open.
#include "tests/kernels/convex/random_block.h"
#include "tests/kernels/isas.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <string>

namespace {

using namespace cab;
using namespace cab::tests;
using oracle::JudgedCase;

}  // namespace

TEST_CASE("no pair of shapes that touches is called apart, none that is apart is called touching, by any kernel") {
  std::uint64_t seed = 0;
  for (unsigned r = 0; r < oracle::kConvexRegimeCount; ++r) {
    const auto regime = static_cast<ConvexRegime>(r);
    std::uint64_t undecided = 0, pairs = 0, wrong_apart = 0, wrong_touching = 0;
    for (const ShapeKind kind_a : oracle::kCaseKinds)
      for (const ShapeKind kind_b : oracle::kCaseKinds)
        for (std::uint64_t round = 0; round < rounds(16); ++round) {
          ++seed;
          CAPTURE(seed);
          Random random(seed);
          const RandomBlock made(random, regime, kind_a, kind_b);
          const kernel::ConvexAnswer answer = available_kernels()[0]->test_convex_pairs(made.block);
          for (const kernel::KernelTable* kernels : available_kernels()) {
            CAPTURE(std::string(name_of(*kernels)));
            CAPTURE(static_cast<int>(kind_a));
            CAPTURE(static_cast<int>(kind_b));
            CAPTURE(r);
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
    if (regime == ConvexRegime::kRegular || regime == ConvexRegime::kUnits) CHECK(undecided * 200 <= pairs);
  }
}

TEST_CASE("few pairs of everyday shapes are left undecided, and every lane decides some") {
  std::uint64_t seed = 0, undecided = 0, pairs = 0;
  for (const ShapeKind kind_a : oracle::kCaseKinds)
    for (const ShapeKind kind_b : oracle::kCaseKinds) {
      CAPTURE(static_cast<int>(kind_a));
      CAPTURE(static_cast<int>(kind_b));
      std::uint32_t apart = 0, touching = 0;
      for (std::uint64_t round = 0; round < 64 * rounds(1); ++round) {
        Random random(++seed);
        const RandomBlock made(random, ConvexRegime::kRegular, kind_a, kind_b);
        const kernel::ConvexAnswer answer = available_kernels().back()->test_convex_pairs(made.block);
        apart |= answer.apart;
        touching |= answer.touching;
        undecided += kLanes - static_cast<unsigned>(__builtin_popcount(answer.apart | answer.touching));
        pairs += kLanes;
      }
      const bool two_half_spaces = kind_a == ShapeKind::kHalfSpace && kind_b == ShapeKind::kHalfSpace;
      CHECK(apart == (two_half_spaces ? 0 : 0xffff));
      CHECK(touching == 0xffff);
    }
  CHECK(undecided * 200 <= pairs);
}

// The instruction set `scalar` looks for the vertices of one lane at a time.
TEST_CASE("lanes that share a hull get the answers of lanes that do not, whatever the run of lanes") {
  std::uint32_t apart = 0, touching = 0;
  for (std::uint64_t seed = 1; seed <= rounds(60); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    const ShapeKind other_kinds[] = {ShapeKind::kConvexHull, ShapeKind::kEllipsoid, ShapeKind::kCapsule};
    RandomBlock made(random, ConvexRegime::kRegular, ShapeKind::kConvexHull, other_kinds[seed % 3]);
    for (std::uint32_t begin = 0, end; begin < kLanes; begin = end) {
      end = std::min<std::uint32_t>(kLanes, begin + 1 + static_cast<std::uint32_t>(random.uniform(0, kLanes)));
      for (std::uint32_t lane = begin; lane < end; ++lane) {
        made.block.a.shape[lane] = made.block.a.shape[begin];
        made.block.b.shape[lane] = made.block.b.shape[begin];
        made.block.scale[lane] = made.block.scale[begin];
      }
    }
    const kernel::ConvexAnswer answer = available_kernels()[0]->test_convex_pairs(made.block);
    for (const kernel::KernelTable* kernels : available_kernels()) {
      CAPTURE(std::string(name_of(*kernels)));
      const kernel::ConvexAnswer other = kernels->test_convex_pairs(made.block);
      CHECK(other.apart == answer.apart);
      CHECK(other.touching == answer.touching);
    }
    apart += static_cast<std::uint32_t>(__builtin_popcount(answer.apart));
    touching += static_cast<std::uint32_t>(__builtin_popcount(answer.touching));
  }
  CHECK(apart > 0);
  CHECK(touching > 0);
}
