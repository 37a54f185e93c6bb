// The broad phase: distance never hides a touching pair, however far out in the world it stands.
#include "perf/oracle/random_world.h"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>

namespace {

using namespace cab;
using namespace cab::oracle;

// Two instances of one unit cube, the second at a distance along x from the first.
World two_cubes(const oracle::Vec3<double>& at, double distance, BatchKind kind) {
  Rig rig;
  rig.parents = {-1};
  rig.leaves = {{0, {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0.5f, 0.5f, 0.5f}}, {}}};
  World world;
  for (int m = 0; m < 2; ++m) {
    Poses poses;
    poses.link_count = poses.instance_count = 1;
    poses.data = {0, 0, 0, 1, 0, 0, 0};
    poses.origins = {at[0] + (m ? distance : 0), at[1], at[2]};
    world.members.push_back({rig, poses, kind});
  }
  world.rules = {{{1}, {2}, Pairing::kBetween}};
  return world;
}

constexpr Policies kPolicies[] = {{Refit::kCab, Strategy::kTree, Exact::kNone},
                                  {Refit::kCab, Strategy::kBrute, Exact::kNone},
                                  {Refit::kAabbHull, Strategy::kTree, Exact::kNone},
                                  {Refit::kAabbHull, Strategy::kBrute, Exact::kNone}};
constexpr BatchKind kKinds[] = {BatchKind::kCharacters, BatchKind::kFrames};

}  // namespace

TEST_CASE("cubes that touch touch, and cubes a thousandth apart do not, out to 1e9 and across the world's origin") {
  for (const double out : {0.0, 1.0, 1e6, -1e9, 4e9}) {
    for (const BatchKind kind : kKinds) {
      for (const Policies& policies : kPolicies) {
        CAPTURE(out);
        const oracle::Vec3<double> at = {{out, -out / 3, out / 7}};
        CHECK(run_world(two_cubes(at, 1.0, kind), policies).hits.size() == 1);  // face on face
        CHECK(run_world(two_cubes(at, -1.0, kind), policies).hits.size() == 1);
        CHECK(run_world(two_cubes(at, 1.001, kind), policies).hits.empty());
        CHECK(run_world(two_cubes(at, -1.001, kind), policies).hits.empty());
      }
    }
  }
}

TEST_CASE("origins at the ends of double's range neither lose nor invent a pair") {
  const double huge = std::numeric_limits<double>::max();
  for (const double out : {1e30, 1e300, huge}) {
    for (const BatchKind kind : kKinds) {
      for (const Policies& policies : kPolicies) {
        CAPTURE(out);
        World world = two_cubes({{out, 0, -out}}, 0, kind);
        CHECK(run_world(world, policies).hits.size() == 1);
        world.members[1].poses.origins[0] = -out;
        CHECK(run_world(world, policies).hits.empty());
        world.members[1].poses.origins = {0, 0, 0};
        CHECK(run_world(world, policies).hits.empty());
      }
    }
  }
}

TEST_CASE("cubes face on face touch even where the step from one double to the next is as large as they are") {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    CAPTURE(seed);
    Random random(seed);
    const int scale = 20 + static_cast<int>(random.index(40));
    const double step = std::ldexp(1.0, scale - 53);  // between doubles of 2^(scale - 1) to 2^scale
    oracle::Vec3<double> at{};
    for (double& c : at.v) c = random.sign() * std::ldexp(0.5, scale) * random.uniform(1.0, 1.9);
    const double width = step * (1 + random.index(7));
    for (const BatchKind kind : kKinds) {
      World world = two_cubes(at, std::copysign(width, -at[0]), kind);  // towards the origin: exact
      for (Member& member : world.members)
        for (float& half : member.rig.leaves[0].box.half) half = static_cast<float>(width / 2);
      REQUIRE(std::fabs(world.members[1].poses.origins[0] - at[0]) == width);
      for (const Policies& policies : kPolicies) CHECK(run_world(world, policies).hits.size() == 1);
    }
  }
}

TEST_CASE(
    "the broad phase rejects no pair that the leaf test accepts: characters as frames, about the edge of touching") {
  for (const double out : {0.0, 1e7, 1e9}) {
    std::size_t hits = 0;
    for (int i = 0; i < 400; ++i) {
      CAPTURE(out);
      CAPTURE(i);
      const double distance = 1 + 5e-8 * i;
      const auto answer = [&](BatchKind kind, const Policies& policies) {
        return run_world(two_cubes({{out, out, -out}}, distance, kind), policies).hits.size();
      };
      const std::size_t expected = answer(BatchKind::kFrames, kPolicies[0]);
      CHECK(answer(BatchKind::kCharacters, kPolicies[0]) == expected);
      CHECK(answer(BatchKind::kCharacters, kPolicies[1]) == expected);
      CHECK(answer(BatchKind::kCharacters, kPolicies[2]) == answer(BatchKind::kFrames, kPolicies[2]));
      hits += expected;
    }
    CHECK(hits > 20);
    CHECK(hits < 380);
  }
}

TEST_CASE("a long line of characters meets only its neighbours, each once") {
  World world = two_cubes({}, 0, BatchKind::kCharacters);
  world.members.pop_back();
  Poses& poses = world.members[0].poses;
  const std::uint32_t n = 500;
  poses.instance_count = n;
  poses.origins.clear();
  poses.data.clear();
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t place = i * 7 % n;  // shuffled
    poses.origins.insert(poses.origins.end(), {0.9 * place, 0, 0});
    poses.data.insert(poses.data.end(), {0, 0, 0, 1, 0, 0, 0});
  }
  world.rules = {{{1}, {1}, Pairing::kBetween}};
  const Outcome outcome = run_world(world);
  CHECK(outcome.hits.size() == n - 1);
  for (const Hit& hit : outcome.hits) {
    const int a = static_cast<int>(hit.instance_a * 7 % n), b = static_cast<int>(hit.instance_b * 7 % n);
    CHECK(std::abs(a - b) == 1);
  }
}

TEST_CASE("every instance of a crowd in one place is paired with every other") {
  World world = two_cubes({}, 0, BatchKind::kCharacters);
  for (Member& member : world.members) {
    member.poses.origins.clear();
    member.poses.instance_count = 40;
    for (int i = 1; i < 40; ++i) member.poses.data.insert(member.poses.data.end(), {0, 0, 0, 1, 0, 0, 0});
  }
  world.rules = {{{1}, {2}, Pairing::kBetween}};
  CHECK(run_world(world).hits.size() == 1600);
  world.rules = {{{2}, {2}, Pairing::kBetween}};
  CHECK(run_world(world).hits.size() == 780);
}
