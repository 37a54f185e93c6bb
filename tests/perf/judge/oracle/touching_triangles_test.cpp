// Touching triangles of two sets, beside an exact intersection of every two in integers.
#include "perf/judge/oracle/touching_triangles.h"

#include "perf/judge/oracle/random.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <cstddef>
#include <set>
#include <utility>
#include <vector>

namespace cab::tests {
namespace {

using namespace cab::oracle;

// Triangles with corners on a grid of so many steps, so that many share corners, edges and planes.
std::vector<Triangle<Wide>> on_grid(Random& random, unsigned steps, const Vec3<Wide>& from) {
  std::vector<Triangle<Wide>> out(random.index(30));
  for (Triangle<Wide>& triangle : out)
    for (Vec3<Wide>& corner : triangle.corner)
      for (std::size_t c = 0; c < 3; ++c) corner[c] = from[c] + static_cast<Wide>(random.index(steps));
  return out;
}

TriangleSet in_double(const std::vector<Triangle<Wide>>& triangles) {
  std::vector<Triangle<double>> out;
  for (const Triangle<Wide>& triangle : triangles) {
    out.emplace_back();
    for (std::size_t k = 0; k < 3; ++k) out.back().corner[k] = convert<double>(triangle.corner[k]);
  }
  return TriangleSet(std::move(out));
}

}  // namespace

TEST_CASE("pairs of triangles that touch are those that an exact intersection finds, each once") {
  using Pairs = std::multiset<std::pair<std::size_t, std::size_t>>;
  std::size_t touching = 0, apart = 0;
  for (std::uint64_t seed = 1; seed <= rounds(300); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    const unsigned steps = random.chance(0.5) ? 5 : 100000;
    const Wide away = random.chance(0.3) ? static_cast<Wide>(steps / 2) : 0;
    const std::vector<Triangle<Wide>> a = on_grid(random, steps, {{0, 0, 0}}),
                                      b = on_grid(random, steps, {{away, 0, 0}});
    Pairs expected, found;
    for (std::size_t x = 0; x < a.size(); ++x)
      for (std::size_t y = 0; y < b.size(); ++y)
        if (meet(a[x], b[y])) expected.emplace(x, y);
    const TriangleSet set_a = in_double(a), set_b = in_double(b);
    for_touching(set_a, set_b, [&](std::size_t x, std::size_t y) {
      found.emplace(x, y);
      return true;
    });
    CHECK(found == expected);
    CHECK(any_touch(set_a, set_b) == !expected.empty());
    std::size_t calls = 0;
    for_touching(set_a, set_b, [&](std::size_t, std::size_t) { return ++calls < 2; });
    CHECK(calls == std::min<std::size_t>(2, expected.size()));
    touching += expected.size();
    apart += a.size() * b.size() - expected.size();
  }
  CHECK(touching >= least_count(3000, 300));
  CHECK(apart >= least_count(3000, 300));
}

}  // namespace cab::tests
