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

PlacedShape placed(const kernel::ConvexSide& side, std::uint32_t lane) {
  return {side.shape[lane], side.format, side.pose[lane], side.orientation[lane]};
}

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

TEST_CASE("a contact in double is as deep as parting the shapes takes, and no gap is reported too wide") {
  const kernel::FloatMode mode;
  std::uint64_t seed = 5000;
  // What float leaves of depths and of the numbers that they are differences of, in parts of the size.
  constexpr Real kRounded = 4e-7L;
  for (unsigned r = 0; r < oracle::kConvexRegimeCount; ++r) {
    CAPTURE(r);
    std::uint64_t deep = 0, above_1 = 0, above_10 = 0, gaps = 0;
    for (const ShapeKind kind_a : oracle::kCaseKinds)
      for (const ShapeKind kind_b : oracle::kCaseKinds) {
        CAPTURE(static_cast<int>(kind_a));
        CAPTURE(static_cast<int>(kind_b));
        const bool exact = kind_a == kind_b && (kind_a == ShapeKind::kBox || kind_a == ShapeKind::kCapsule);
        for (std::uint64_t round = 0; round < rounds(1); ++round) {
          Random random(++seed);
          CAPTURE(seed);
          const RandomBlock made(random, static_cast<ConvexRegime>(r), kind_a, kind_b);
          for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
            CAPTURE(lane);
            const auto& by = made.block.shift.by;
            const Contact contact = contact_in_double(placed(made.block.a, lane), placed(made.block.b, lane),
                                                      {by[0][lane], by[1][lane], by[2][lane]});
            const JudgedCase judged = judge_case(made.cases[lane], oracle::Effort::kMeasure);
            const Real rounded = kRounded * judged.size, depth = contact.depth;
            if (judged.verdict.gap_at_least > 0) {
              ++gaps;
              CHECK(-depth <= judged.verdict.gap_at_most + rounded);
              CHECK(-depth >= judged.verdict.gap_at_least - rounded);
            } else if (judged.verdict.gap_at_most < 0) {
              const Real least = -judged.verdict.gap_at_most;
              CHECK(depth >= least - rounded);
              ConvexCase parted = made.cases[lane];
              bind_vertices(parted);
              for (std::size_t c = 0; c < 3; ++c)
                parted.shift[c] += static_cast<double>(contact.normal[c] * (depth + rounded));
              CHECK(judge_case(parted, oracle::Effort::kMeasure).verdict.gap_at_most >= -2 * rounded);
              if (exact) CHECK(depth <= least + rounded);
              if (least < Real{1e-3} * judged.size) continue;
              ++deep;
              above_1 += depth > Real{1.01} * least;
              above_10 += depth > Real{1.1} * least;
            }
          }
        }
      }
    MESSAGE("regime " << r << ": " << gaps << " gaps, " << deep << " depths, of which " << above_1
                      << " are over 1 % and " << above_10 << " over 10 % above the least");
    CHECK(above_10 * 10 <= deep);
  }
}
