// Hulls in double: what they contain, and how many vertices they need.
#include "scenes/rig/hull.h"

#include "scenes/random.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace {

using namespace cab::scenes;

// How far a point may be outside, as a share of the longest side of the points' bounding box: the 1e-9 that convex_hull
// leaves out, and twice the 6.4e-12 by which its grid moves a point. Worst measured 9.999e-10.
constexpr double kOutsideTolerance = 1.013e-9;

double longest_side(const std::vector<Vec3>& points) {
  double longest = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto [low, high] =
        std::minmax_element(points.begin(), points.end(), [k](const Vec3& a, const Vec3& b) { return a[k] < b[k]; });
    longest = std::max(longest, (*high)[k] - (*low)[k]);
  }
  return longest;
}

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

// How far points are outside of the hull of the vertices, along the normals of all faces that three vertices may have,
// whatever faces the hull says that it has.
double lost(const std::vector<Vec3>& vertices, const std::vector<Vec3>& points) {
  using Long3 = std::array<long double, 3>;
  const auto from_to = [](const Vec3& a, const Vec3& b) {
    return Long3{0.0L + b[0] - a[0], 0.0L + b[1] - a[1], 0.0L + b[2] - a[2]};
  };
  const auto along = [](const Long3& a, const Long3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; };
  long double most = 0;
  const long double flat = kOutsideTolerance * longest_side(vertices);
  for (std::size_t i = 0; i < vertices.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      for (std::size_t k = 0; k < j; ++k) {
        const Long3 u = from_to(vertices[i], vertices[j]), v = from_to(vertices[i], vertices[k]);
        Long3 normal = {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
        const long double area = std::sqrt(along(normal, normal));
        if (!(area > 0)) continue;
        for (long double& component : normal) component /= area;
        long double low = 0, high = 0;
        for (std::size_t n = 0; n < vertices.size() && (low >= -flat || high <= flat); ++n) {
          const long double height = along(normal, from_to(vertices[i], vertices[n]));
          low = std::min(low, height);
          high = std::max(high, height);
        }
        if (low < -flat && high > flat) continue;
        for (const Vec3& point : points) {
          const long double height = along(normal, from_to(vertices[i], point));
          if (high <= flat) most = std::max(most, height - high);
          if (low >= -flat) most = std::max(most, low - height);
        }
      }
  return static_cast<double>(most);
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

TEST_CASE("no corner is lost where points are beside a plane by no more than noise, and each edge has two faces") {
  std::size_t corners = 0;
  for (std::uint64_t seed = 1; seed <= cab::tests::rounds(500); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    const double off = std::pow(10, random.uniform(-9.5, -7.5)), turn = random.angle();
    const std::uint32_t count = 50 + random.index(250);
    std::vector<Vec3> points;
    for (std::uint32_t i = 0; i < count; ++i) {
      Vec3 p = {.25 * random.index(5), .25 * random.index(5), .25 * random.index(5)};
      const double angle = .5235987755982988 * random.index(12);
      if (seed % 4 == 1) p = {std::cos(angle), std::sin(angle), .1 * random.index(9)};
      if (seed % 4 == 2) p = {.1 * random.index(9), .05 * random.index(9), .02 * random.index(3)};
      if (seed % 4 == 3) p = rotate({0, std::sin(turn), 0, std::cos(turn)}, p);
      for (double& component : p) {
        component += random.uniform(-off, off);
        if (seed % 3 > 0) component = static_cast<double>(static_cast<float>(component));
      }
      points.push_back(p);
    }
    const double side = longest_side(points);
    const Hull hull = convex_hull(points, points.size());
    CHECK(hull.faces.size() == 2 * hull.vertices.size() - 4);
    CHECK(highest(hull, points) <= kOutsideTolerance * side);
    CHECK(lost(hull.vertices, points) <= kOutsideTolerance * side);
    const Hull few = enclosing_hull(hull.vertices, 40);
    CHECK(few.faces.size() == 2 * few.vertices.size() - 4);
    CHECK(lost(few.vertices, points) <= kOutsideTolerance * side);
    corners += hull.vertices.size();
  }
  CHECK(corners > cab::tests::least_count(10000, 500));
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
