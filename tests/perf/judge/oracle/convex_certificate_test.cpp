// The cheap proofs about convex shapes against the judge.
#include "perf/judge/oracle/convex_certificate.h"

#include "perf/judge/oracle/convex_pairs.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <cmath>

namespace {

using namespace cab;
using namespace cab::oracle;
using cab::tests::rounds;

// Calls what(random, case) for cases of every regime and every two kinds.
template <class What>
void for_each_case(std::uint64_t seed, std::uint64_t count, const What& what) {
  for (unsigned r = 0; r < kConvexRegimeCount; ++r) {
    CAPTURE(r);
    for (const ShapeKind kind_a : kCaseKinds)
      for (const ShapeKind kind_b : kCaseKinds) {
        CAPTURE(static_cast<int>(kind_a));
        CAPTURE(static_cast<int>(kind_b));
        for (std::uint64_t i = 0; i < count; ++i) {
          ++seed;
          CAPTURE(seed);
          Random random(seed);
          const ConvexCase made = make_convex_case(random, static_cast<ConvexRegime>(r), kind_a, kind_b);
          what(random, made);
        }
      }
  }
}

bool contradicts(Proof proof, const Verdict& verdict) {
  return (proof == Proof::kApart && verdict.gap_at_most < 0) || (proof == Proof::kTouching && are_apart(verdict));
}

}  // namespace

TEST_CASE("no certificate is wrong, and few pairs have none") {
  std::uint64_t judged = 0, none = 0, apart = 0, touching = 0;
  for_each_case(0, rounds(16), [&](Random&, const ConvexCase& made) {
    const JudgedShapes shapes(made);
    const Proof proof = certify(shapes.a, shapes.b, Effort::kDecide).proof;
    CHECK_FALSE(contradicts(proof, judge(shapes.a, shapes.b, Effort::kDecide)));
    if (made.a.part.kind == ShapeKind::kHalfSpace || made.b.part.kind == ShapeKind::kHalfSpace) return;  // no proof
    ++judged;
    none += proof == Proof::kNone;
    apart += proof == Proof::kApart;
    touching += proof == Proof::kTouching;
  });
  MESSAGE(judged << " pairs: " << apart << " apart, " << touching << " touching, " << none << " without a proof");
  CHECK(none * 50 <= judged);  // most of them are boxes with one centre
  CHECK(apart * 10 >= judged);
  CHECK(touching * 10 >= judged);
}

TEST_CASE("no certificate is wrong about shapes whose gap is near the bound of its rounding") {
  std::uint64_t judged = 0, proven = 0;
  for_each_case(100000, rounds(2), [&](Random& random, const ConvexCase& made) {
    JudgedShapes shapes(made);
    const Verdict before = judge(shapes.a, shapes.b, Effort::kMeasure);
    if (!std::isfinite(before.gap_at_most)) return;  // of two half spaces
    const JudgedCase whole = judge_case(made, Effort::kDecide);
    const Real gap = are_apart(before) ? before.gap_at_least : before.gap_at_most;
    // From far below the rounding to far above it. A depth is the least found, so this takes either sign.
    const Real wanted = random.sign() * random.log_uniform(0x1p-54, 0x1p-42) * whole.size;
    shapes.b.pose.at = shapes.b.pose.at + (wanted - gap) * before.normal;
    const Proof proof = certify(shapes.a, shapes.b, Effort::kDecide).proof;
    CHECK_FALSE(contradicts(proof, judge(shapes.a, shapes.b, Effort::kDecide)));
    ++judged;
    proven += proof != Proof::kNone;
  });
  MESSAGE(proven << " of " << judged << " pairs have a proof");
  CHECK(proven * 10 >= judged);
  CHECK(proven < judged);
}

TEST_CASE("a certificate measures gaps as the judge does") {
  Real widest = 0;
  std::uint64_t measured = 0;
  for_each_case(200000, rounds(1), [&](Random&, const ConvexCase& made) {
    const JudgedShapes shapes(made);
    const Certificate found = certify(shapes.a, shapes.b, Effort::kMeasure);
    if (found.proof != Proof::kApart) return;
    const JudgedCase judged = judge_case(made, Effort::kMeasure);
    ++measured;
    const Real gap = found.gap;
    CHECK(gap <= judged.verdict.gap_at_most + Real{kCertificateRounding} * judged.size);
    widest = std::max(widest, (judged.verdict.gap_at_least - gap) / judged.size);
    CHECK(std::fabs(norm(found.normal) - 1) < 1e-15);
  });
  MESSAGE(measured << " gaps; the most that one is below the judge's, in parts of the size: "
                   << static_cast<double>(widest));
  CHECK(measured > 0);
  CHECK(widest < 1e-11L);
}
