// Hulls in double: what they contain, and how many vertices they need.
#include "scenes/rig/hull.h"

#include "scenes/random.h"

#include <doctest/doctest.h>

#include <cmath>

namespace {

using namespace cab::scenes;

// Share of the size of the hull. Worst measured 0 for points on a grid, 1.2e-10 for those of a ball.
constexpr double kOutsideTolerance = 2e-9;

double highest(const Hull& hull, const std::vector<Vec3>& points) {
  double most = -1;
  for (const Plane& plane : hull.planes)
    for (const Vec3& point : points) most = std::max(most, dot(plane.normal, point) - plane.offset);
  return most;
}

std::vector<Vec3> ball_points(std::size_t count) {
  Random random(7);
  std::vector<Vec3> points;
  while (points.size() < count) {
    const Vec3 p = {random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
    if (length(p) <= 1) points.push_back(p);
  }
  return points;
}

}  // namespace

TEST_CASE("a hull contains its points, on grids with many points in a plane too") {
  std::vector<Vec3> grid;
  for (int i = 0; i < 343; ++i) grid.push_back({.1 * (i % 7), .1 * (i / 7 % 7), .1 * (i / 49)});
  const Hull cube = convex_hull(grid, grid.size());
  CHECK(highest(cube, grid) <= kOutsideTolerance);
  CHECK(cube.volume == doctest::Approx(.216));
  const std::vector<Vec3> ball = ball_points(2000);
  const Hull round = convex_hull(ball, ball.size());
  CHECK(highest(round, ball) <= kOutsideTolerance);
  CHECK(round.volume > .9 * 4.18);
  CHECK(round.volume < 4.19);
}

TEST_CASE("a hull of few vertices contains all points, and shrinks as it may have more") {
  const std::vector<Vec3> ball = ball_points(2000);
  double volume = 1e300;
  for (const std::size_t most : {8u, 16u, 32u, 64u, 128u}) {
    const Hull hull = enclosing_hull(ball, most);
    CAPTURE(most);
    CHECK(hull.vertices.size() <= most);
    CHECK(highest(hull, ball) <= 0);
    CHECK(hull.volume < volume);
    volume = hull.volume;
  }
  CHECK(volume < 1.2 * convex_hull(ball, ball.size()).volume);
}

TEST_CASE("points that are beside a plane by no more than rounding leave each edge of a hull with two faces") {
  Random random(7);
  for (int round = 0; round < 100; ++round) {
    CAPTURE(round);
    const double off = std::pow(10, random.uniform(-11, -5));
    std::vector<Vec3> tube;
    for (int i = 0; i < 300; ++i) {
      const double angle = .5236 * std::floor(random.uniform(0, 12)), at = .1 * std::floor(random.uniform(0, 9));
      tube.push_back({std::cos(angle), std::sin(angle), at + random.uniform(0, off)});
    }
    const Hull hull = convex_hull(tube, tube.size());
    CHECK(hull.faces.size() == 2 * hull.vertices.size() - 4);
    CHECK(highest(hull, tube) <= 1e-8);
    CHECK(hull.volume == doctest::Approx(2.4).epsilon(.01));  // of a prism with twelve sides
  }
}

TEST_CASE("points in one plane have a hull without faces") {
  CHECK(convex_hull({}, 4).faces.empty());
  CHECK(convex_hull({{1, 2, 3}, {1, 2, 3}}, 4).faces.empty());
  CHECK(convex_hull({{0, 0, 0}, {1, 1, 1}, {3, 3, 3}}, 4).faces.empty());
  CHECK(convex_hull({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {.5, .2, 0}}, 5).faces.empty());
  CHECK(convex_hull({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, .01}}, 4).faces.size() == 4);
}

TEST_CASE("the distance to a triangle is that to its nearest corner, edge or inside") {
  const std::array<Vec3, 3> triangle = {Vec3{0, 0, 0}, Vec3{4, 0, 0}, Vec3{0, 4, 0}};
  CHECK(distance_to_triangle({1, 1, 2}, triangle) == doctest::Approx(2));
  CHECK(distance_to_triangle({1, 1, -2}, triangle) == doctest::Approx(2));
  CHECK(distance_to_triangle({2, -3, 4}, triangle) == doctest::Approx(5));
  CHECK(distance_to_triangle({-3, -4, 12}, triangle) == doctest::Approx(13));
  CHECK(distance_to_triangle({4, 4, 0}, triangle) == doctest::Approx(std::sqrt(8)));
}
