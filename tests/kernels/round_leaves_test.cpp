// Balls and capsules against segments in long double: what touches does, what is called apart is, and little is left.
#include "kernels/round_leaves.h"

#include "layout/error_bounds.h"
#include "perf/judge/oracle/random.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

namespace cab::tests {
namespace {

using oracle::Random;
using Real = long double;
using Real3 = oracle::Vec3<Real>;

// All points from center - axis to center + axis.
struct Segment {
  Real3 center, axis;
};

Real distance_at(const Segment& a, const Segment& b, Real s, Real t) {
  const Real3 v = a.center + s * a.axis - (b.center + t * b.axis);
  return std::sqrt(dot(v, v));
}

// The least distance: at the critical point if it is within both segments, else on one of the four edges.
Real distance(const Segment& a, const Segment& b) {
  const Real3 w = a.center - b.center;
  const Real aa = dot(a.axis, a.axis), bb = dot(b.axis, b.axis), ab = dot(a.axis, b.axis);
  const auto clamped = [](Real x) { return std::clamp(x, Real{-1}, Real{1}); };
  Real best = HUGE_VALL;
  for (const Real end : {Real{-1}, Real{1}}) {
    best = std::min(best, distance_at(a, b, end, bb > 0 ? clamped((ab * end + dot(b.axis, w)) / bb) : 0));
    best = std::min(best, distance_at(a, b, aa > 0 ? clamped((ab * end - dot(a.axis, w)) / aa) : 0, end));
  }
  if (const Real det = aa * bb - ab * ab; det > 0) {
    const Real s = (ab * dot(b.axis, w) - bb * dot(a.axis, w)) / det,
               t = (aa * dot(b.axis, w) - ab * dot(a.axis, w)) / det;
    if (std::fabs(s) <= 1 && std::fabs(t) <= 1) best = std::min(best, distance_at(a, b, s, t));
  }
  return best;
}

void fill(const Segment& from, RoundTile& to) {
  Real size = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    to.center[c][0] = static_cast<float>(from.center[c]);
    to.axis[c][0] = static_cast<float>(from.axis[c]);
    size += std::fabs(from.center[c]) + std::fabs(from.axis[c]);
  }
  to.size[0] = static_cast<float>(size);
}

// What the kernel has of it.
Segment of_tile(const RoundTile& tile) {
  Segment out;
  for (std::size_t c = 0; c < 3; ++c) {
    out.center[c] = Real{tile.center[c][0]};
    out.axis[c] = Real{tile.axis[c][0]};
  }
  return out;
}

Real3 random_vector(Random& random, double length) {
  const auto v = random.unit_vector();
  return Real{length} * Real3{v[0], v[1], v[2]};
}

struct Counts {
  std::size_t touching = 0, apart = 0, left = 0, left_far = 0;
};

template <bool kBalls>
void try_pair(Random& random, Counts& counts) {
  const double unit = random.log_uniform(1e-9, 1e8);
  Segment a = {random_vector(random, random.uniform(0, 1) * unit), {}};
  Segment b = {random_vector(random, random.uniform(0, 2) * unit), {}};
  if (!kBalls) {
    a.axis = random_vector(random, random.log_uniform(1e-3, 1) * unit);
    b.axis = random.chance(0.2) ? a.axis : random_vector(random, random.log_uniform(1e-3, 1) * unit);
    if (random.chance(0.1)) b.axis = {};
    if (random.chance(0.1)) b.center = a.center;
    if (random.chance(0.2)) b.axis = b.axis + random_vector(random, 1e-5 * unit);
  }
  RoundTile tile_a = {}, tile_b = {};
  fill(a, tile_a);
  fill(b, tile_b);
  const Real exact = distance(of_tile(tile_a), of_tile(tile_b));
  const double near = random.chance(0.5) ? random.uniform(-1e-5, 1e-5) : random.uniform(-1, 1);
  const auto radii = static_cast<float>(exact * (1 + near) + (random.chance(0.5) ? 0 : random.uniform(0, 1) * unit));
  const kernel::RoundAnswer answer = kernel::test_round_lanes<float, kBalls>(tile_a, tile_b, radii, 0);
  const bool touching = answer.touching & 1, possible = answer.possible & 1;
  CHECK((possible || !touching));
  if (touching) CHECK(exact <= Real{radii});
  if (!possible) CHECK(exact > Real{radii});
  counts.touching += touching;
  counts.apart += !possible;
  const Real slack = Real{kRoundSlack} * (Real{tile_a.size[0]} + Real{tile_b.size[0]} + Real{radii});
  if (touching || !possible) return;
  ++counts.left;
  counts.left_far += std::fabs(exact - Real{radii}) > 2 * slack + Real{kRoundTiny};
}

}  // namespace

TEST_CASE("round leaves: what touches does, what is apart is, and what is left is near") {
  Counts balls, capsules;
  for (std::uint64_t seed = 1; seed <= rounds(400000); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    try_pair<true>(random, balls);
    try_pair<false>(random, capsules);
  }
  for (const Counts& counts : {balls, capsules}) {
    CHECK(counts.touching >= least_count(100000, 400000));
    CHECK(counts.apart >= least_count(50000, 400000));
    CHECK(counts.left > 0);
  }
  CHECK(balls.left_far == 0);
  CHECK(capsules.left_far < capsules.touching / 1000 + 1);  // where segments are nearly parallel or meet
}

}  // namespace cab::tests
