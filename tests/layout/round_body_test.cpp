// Round bodies: which articulations have one, and balls that hold the leaves of their links.
#include "layout/round_body.h"

#include "perf/harness/random_rig.h"
#include "perf/harness/round_rig.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <cmath>

namespace cab::tests {
namespace {

using namespace cab::oracle;

struct Built {
  explicit Built(const RoundRig& rig) : arena(default_allocator()) {
    REQUIRE(build_articulation(rig.desc(), arena, &articulation, nullptr) == Status::kOk);
    const ConvexShapes shapes = make_convex_shapes(articulation, arena);
    round = make_round_body(articulation, shapes, arena);
  }
  Arena arena;
  Articulation articulation;
  RoundBody round;
};

double distance(const float (&a)[3], const float (&b)[3]) {
  double sum = 0;
  for (int c = 0; c < 3; ++c) sum += std::pow(static_cast<double>(a[c]) - static_cast<double>(b[c]), 2);
  return std::sqrt(sum);
}

}  // namespace

TEST_CASE("a body of balls and capsules is round, and the ball of a link holds its leaves") {
  for (std::uint64_t seed = 1; seed <= rounds(100); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    const RoundRig rig = random_round_rig(random, 1 + random.index(8), 4);
    const Built built(rig);
    const RoundBody& body = built.round;
    REQUIRE(body.leaves.size == built.articulation.leaf_count);
    std::size_t next = 0;
    for (const RoundLink& link : body.links) {
      CHECK(link.begin == next);
      next = link.end;
      for (std::size_t l = link.begin; l < link.end; ++l) {
        const RoundLeaf& leaf = body.leaves[l];
        CHECK(built.articulation.leaf_link[leaf.leaf] == link.link);
        CHECK((l == link.begin || body.leaves[l - 1].leaf < leaf.leaf));
        CHECK(distance(leaf.center, link.ball.center) + static_cast<double>(leaf.reach) <=
              static_cast<double>(link.ball.reach));
      }
    }
    CHECK(next == body.leaves.size);
    for (std::size_t k = 1; k < body.links.size; ++k) CHECK(body.links[k - 1].link < body.links[k].link);
  }
}

TEST_CASE("a body with a box, with two parts on a leaf, or beyond 1e9 is not round") {
  Random random(1);
  const RoundRig rig = random_round_rig(random, 3, 2);
  CHECK(!Built(rig).round.leaves.empty());
  RoundRig box = rig;
  box.parts.back().kind = ShapeKind::kBox;
  for (float& x : box.parts.back().size) x = 0.01f;
  CHECK(Built(box).round.leaves.empty());
  RoundRig without = rig;
  without.part_count.back() = 0;
  CHECK(Built(without).round.leaves.empty());
  RoundRig far = rig;
  far.boxes.back().center[0] = far.parts.back().position[0] = 2e9f;
  far.boxes.back().half[0] = 1e3f;
  CHECK(Built(far).round.leaves.empty());
}

}  // namespace cab::tests
