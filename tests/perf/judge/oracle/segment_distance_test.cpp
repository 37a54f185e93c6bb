// The distance of segments against the judge of convex shapes, and where it is known.
#include "perf/judge/oracle/segment_distance.h"

#include "perf/judge/oracle/convex_judge.h"
#include "perf/judge/oracle/random.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <cmath>

namespace cab::tests {
namespace {

using namespace cab::oracle;

Real distance(const Segment& a, const Segment& b) {
  const Point between = shortest_between(a, b);
  return std::sqrt(dot(between, between));
}

Point random_vector(Random& random, double length) { return convert<Real>(length * random.unit_vector()); }

// The ends of a segment as the vertices of a hull.
Verdict judge_segments(const Segment& a, const Segment& b) {
  const Point ends_a[] = {a.at - a.half, a.at + a.half}, ends_b[] = {b.at - b.half, b.at + b.half};
  JudgeShape shape_a, shape_b;
  shape_a.kind = shape_b.kind = JudgeKind::kHull;
  shape_a.vertices = ends_a;
  shape_b.vertices = ends_b;
  return judge(shape_a, shape_b, Effort::kMeasure);
}

}  // namespace

TEST_CASE("segments are as far apart as the judge of convex shapes says, along the vector between them") {
  for (std::uint64_t seed = 1; seed <= rounds(2000); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    Segment a = {random_vector(random, random.uniform(0, 1)), random_vector(random, random.log_uniform(1e-3, 1))};
    Segment b = {random_vector(random, random.uniform(0, 1)), random_vector(random, random.log_uniform(1e-3, 1))};
    if (random.chance(0.2)) b.half = a.half + random_vector(random, random.log_uniform(1e-9, 1e-3));
    if (random.chance(0.1)) b.half = Real{random.sign()} * a.half;
    if (random.chance(0.1)) a.half = {};
    if (random.chance(0.1)) b.half = {};
    const Verdict verdict = judge_segments(a, b);
    const Real found = distance(a, b);
    CHECK(found <= verdict.gap_at_most + 1e-12L);
    CHECK(found >= verdict.gap_at_least - 1e-12L);
    CHECK(std::fabs(found - distance(b, a)) < 1e-17L);
  }
}

TEST_CASE("segments that cross, lie in one line or are one have the distances that they must have") {
  const Segment along_x = {{{0, 0, 0}}, {{1, 0, 0}}}, across = {{{0.5L, 0, 0}}, {{0, 1, 0}}},
                beyond = {{{3, 0, 0}}, {{1, 0, 0}}}, farther = {{{4, 0, 0}}, {{1, 0, 0}}},
                beside = {{{0, 2, 0}}, {{1, 0, 0}}};
  CHECK(distance(along_x, across) == 0);
  CHECK(distance(along_x, along_x) == 0);
  CHECK(distance(along_x, beyond) == 1);
  CHECK(distance(along_x, farther) == 2);
  CHECK(distance(along_x, beside) == 2);
}

}  // namespace cab::tests
