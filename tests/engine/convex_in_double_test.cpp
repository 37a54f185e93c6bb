// The test in double of two convex shapes against the judge.
#include "engine/convex_in_double.h"

#include "kernels/float_mode.h"
#include "tests/kernels/convex/random_block.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

namespace {

using namespace cab;
using namespace cab::tests;
using oracle::JudgedCase;
using oracle::Real;

// What docs/embedding.md promises: shapes that touch by the test in double are at most this far apart, in parts of
// their size and the distance of their centres from their origins.
constexpr Real kTouching = 0x1p-40L;

}  // namespace

TEST_CASE("in double no pair of shapes that touches is apart, and what touches is at most 2^-40 of its size apart") {
  const kernel::FloatMode mode;
  std::uint64_t seed = 1000;
  for (unsigned r = 0; r < oracle::kConvexRegimeCount; ++r) {
    CAPTURE(r);
    std::uint64_t touching = 0, apart = 0, wrong_apart = 0;
    Real widest = 0;
    for (const ShapeKind kind_a : oracle::kCaseKinds)
      for (const ShapeKind kind_b : oracle::kCaseKinds)
        for (std::uint64_t round = 0; round < rounds(8); ++round) {
          Random random(++seed);
          const RandomBlock made(random, static_cast<ConvexRegime>(r), kind_a, kind_b);
          for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
            const ConvexCase& one = made.cases[lane];
            const JudgedCase judged = judge_case(one, oracle::Effort::kDecide);
            const bool touch = touch_in_double(made.block, lane);
            ++(touch ? touching : apart);
            wrong_apart += !touch && judged.verdict.gap_at_most < 0;
            if (!touch || !(judged.verdict.gap_at_least > 0)) continue;
            Real away = judged.size;
            for (const oracle::PosedPart* posed : {&one.a, &one.b})
              for (std::size_t c = 0; c < 3; ++c)
                away += std::fabs(posed->pose[4 + c]) + std::fabs(posed->part.position[c]);
            const Real gap = judge_case(one, oracle::Effort::kMeasure).verdict.gap_at_most / away;
            widest = std::max(widest, gap);
          }
        }
    MESSAGE("regime " << r << ": " << touching << " touch, " << apart << " apart; widest gap of those that touch "
                      << static_cast<double>(widest));
    CHECK(wrong_apart == 0);
    CHECK(widest <= kTouching);
    CHECK(touching > 0);
    CHECK(apart > 0);
  }
}

TEST_CASE("in double few pairs with an ellipsoid stay undecided, however close they are") {
  const kernel::FloatMode mode;
  std::uint64_t seed = 9000, tested = 0, undecided = 0;
  for (const ConvexRegime regime : {ConvexRegime::kNear, ConvexRegime::kNeedles, ConvexRegime::kPlates})
    for (const ShapeKind kind : oracle::kCaseKinds)
      for (const bool first : {true, false})
        for (std::uint64_t round = 0; round < rounds(8); ++round) {
          Random random(++seed);
          const ShapeKind ellipsoid = ShapeKind::kEllipsoid;
          const RandomBlock made(random, regime, first ? ellipsoid : kind, first ? kind : ellipsoid);
          for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
            const kernel::ConvexAnswer answer = answer_in_double(made.block, lane);
            CHECK((answer.apart & answer.touching) == 0);
            ++tested;
            undecided += answer.apart == 0 && answer.touching == 0;
          }
        }
  MESSAGE(undecided << " of " << tested << " pairs undecided");
  CHECK(undecided * 50 <= tested);  // 6 % without the space in which the ellipsoid is a ball
}
