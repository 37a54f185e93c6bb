// The order of a batch's characters in space, against a judge that cuts a cube into eight, again and again.
#include "perf/harness/random_world.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

namespace {

using namespace cab;
using namespace cab::oracle;

using Order = std::vector<std::uint32_t>;
using Place = Vec3<double>;

// One batch of a cube about a point each, all far smaller than their distances.
World cubes_about(const std::vector<Place>& points, BatchKind kind = BatchKind::kCharacters) {
  World world;
  Member member;
  member.kind = kind;
  member.rig.parents = {-1};
  member.rig.leaves = {{0, {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {1e-6f, 1e-6f, 1e-6f}}, {}}};
  member.poses.link_count = 1;
  member.poses.instance_count = static_cast<std::uint32_t>(points.size());
  for (const Place& point : points) {
    member.poses.data.insert(member.poses.data.end(), {0, 0, 0, 1, 0, 0, 0});
    member.poses.origins.insert(member.poses.origins.end(), {point[0], point[1], point[2]});
  }
  world.members.push_back(member);
  if (kind == BatchKind::kCharacters) world.rules = {{{1}, {1}, Pairing::kBetween}};
  return world;
}

Order order_of(Engine& engine, std::size_t count) {
  Order order(count, ~0u);
  REQUIRE(spatial_order(engine, {1}, order) == Status::kOk);
  return order;
}

Order order_after_frame(const World& world) {
  const EnginePtr engine = make_engine_for(world);
  run_on(*engine, world, {});
  return order_of(*engine, world.members[0].poses.instance_count);
}

Order ascending(std::size_t count) {
  Order order(count);
  std::iota(order.begin(), order.end(), 0u);
  return order;
}

bool is_permutation_of_all(Order order) {
  std::sort(order.begin(), order.end());
  return order == ascending(order.size());
}

// Adds those of `points` that are in a cube with a corner at `lo`, which is 2^level wide: octant by octant, x first,
// then y, then z, and within a cube of width 1 in ascending order.
void add_octants(const std::vector<Place>& points, const Place& lo, int level, Order& out) {
  const double width = std::ldexp(1.0, level);
  Order inside;
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    bool is_inside = true;
    for (std::size_t c = 0; c < 3; ++c) is_inside = is_inside && points[i][c] >= lo[c] && points[i][c] < lo[c] + width;
    if (is_inside) inside.push_back(i);
  }
  if (level == 0 || inside.empty()) {
    out.insert(out.end(), inside.begin(), inside.end());
    return;
  }
  for (unsigned octant = 0; octant < 8; ++octant)
    add_octants(points,
                {{lo[0] + (octant & 1 ? width / 2 : 0), lo[1] + (octant & 2 ? width / 2 : 0),
                  lo[2] + (octant & 4 ? width / 2 : 0)}},
                level - 1, out);
}

double way_along(const std::vector<Place>& points, const Order& order) {
  double way = 0;
  for (std::size_t i = 1; i < order.size(); ++i) {
    const Place step = points[order[i]] - points[order[i - 1]];
    way += std::sqrt(dot(step, step));
  }
  return way;
}

}  // namespace

TEST_CASE("characters are listed octant by octant, each once, those of one cell in ascending order") {
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    CAPTURE(seed);
    Random random(seed);
    std::vector<Place> points;
    // Both corners are there, so that the cube is 15 wide. The points are away from the sides of its sixteenths.
    points.push_back({{0, 0, 0}});
    points.push_back({{15, 15, 15}});
    for (int i = 0; i < 300; ++i)
      points.push_back({{double(random.index(16)), double(random.index(16)), seed % 3 ? double(random.index(16)) : 0}});
    Order expected;
    add_octants(points, {{0, 0, 0}}, 4, expected);
    // Characters of one cell are at one point, so that only their numbers order them.
    CHECK(order_after_frame(cubes_about(points)) == expected);
  }
}

TEST_CASE("the way along the list is far shorter than that in random order") {
  Random random(1);
  std::vector<Place> points;
  for (int i = 0; i < 4096; ++i) points.push_back({{random.uniform(-50, 50), random.uniform(-50, 50), 0}});
  const Order order = order_after_frame(cubes_about(points));
  CHECK(is_permutation_of_all(order));
  CHECK(20 * way_along(points, order) < way_along(points, ascending(points.size())));
}

TEST_CASE("worlds as wide as doubles reach, points in one place and a single character are listed too") {
  const double far = 1e300;
  std::vector<Place> wide = {{{far, 0, 0}}, {{-far, far, 0}}, {{0, 0, -far}}, {{0, 0, 0}}};
  CHECK(is_permutation_of_all(order_after_frame(cubes_about(wide))));
  const double farthest = std::numeric_limits<double>::max();  // the lower bound of a cube there is infinite
  CHECK(order_after_frame(cubes_about({{{5, 5, 5}}, {{1, 1, 1}}, {{-farthest, 0, 0}}})) == Order{2, 0, 1});
  CHECK(order_after_frame(cubes_about(std::vector<Place>(40, Place{{7, 7, 7}}))) == ascending(40));
  CHECK(order_after_frame(cubes_about({{{3, 4, 5}}})) == ascending(1));
}

TEST_CASE("masked characters come last, and without a frame nothing is reordered") {
  // The last one is in the last cell of the curve, before which nobody who is masked may be.
  std::vector<Place> points;
  for (int i = 0; i < 50; ++i) points.push_back({{1.0 * i, 1.0 * i, 1.0 * i}});
  World world = cubes_about(points);
  const EnginePtr engine = make_engine_for(world);
  CHECK(order_of(*engine, 50) == ascending(50));
  for (const std::size_t i : {3u, 31u}) world.members[0].poses.data[7 * i] = std::numeric_limits<float>::quiet_NaN();
  run_on(*engine, world, {});
  Order expected;
  for (std::uint32_t i = 0; i < 50; ++i)
    if (i != 3 && i != 31) expected.push_back(i);
  expected.insert(expected.end(), {3, 31});
  CHECK(order_of(*engine, 50) == expected);
}

TEST_CASE("frames of a sequence keep their order") {
  std::vector<Place> points;
  for (int i = 0; i < 50; ++i) points.push_back({{50.0 - i, 0, 0}});
  CHECK(order_after_frame(cubes_about(points, BatchKind::kSequence)) == ascending(50));
}

TEST_CASE("unknown batches and lists that are too short are refused, and nothing is written") {
  const World world = cubes_about({{{1, 0, 0}}, {{0, 0, 0}}, {{2, 0, 0}}});
  const EnginePtr engine = make_engine_for(world);
  run_on(*engine, world, {});
  Order order(4, 77);
  for (const std::uint32_t id : {0u, 2u, 0xffffffffu})
    CHECK(spatial_order(*engine, {id}, {order.data(), 4}) == Status::kUnknownBatch);
  CHECK(spatial_order(*engine, {1}, {order.data(), 2}) == Status::kBadOutput);
  CHECK(spatial_order(*engine, {1}, {nullptr, 4}) == Status::kBadOutput);
  CHECK(order == Order(4, 77));
  CHECK(spatial_order(*engine, {1}, {order.data(), 4}) == Status::kOk);
  CHECK(order == Order{1, 0, 2, 77});
}
