// Triangles of polygons: they cover the polygon, and of a simple one nothing else.
#include "scenes/import/polygon.h"

#include "scenes/random.h"

#include <doctest/doctest.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace {

using namespace cab::scenes;
using Triangles = std::vector<std::uint32_t>;

// What rounding adds to the area of random polygons, as a share; the worst measured is 2.2e-10.
constexpr double kMostAdded = 1e-8;

Triangles cut(const std::vector<Vec3>& polygon) {
  Triangles triangles;
  cut_polygon(polygon, triangles);
  return triangles;
}

// Twice the area within an outline in a plane, as a vector along the normal.
Vec3 doubled_area(const std::vector<Vec3>& outline) {
  Vec3 sum = {0, 0, 0};
  for (std::size_t k = 2; k < outline.size(); ++k)
    sum = sum + cross(outline[k - 1] - outline[0], outline[k] - outline[0]);
  return sum;
}

// The areas of all triangles over that of the polygon.
double area_ratio(const std::vector<Vec3>& polygon, const Triangles& triangles) {
  double sum = 0;
  for (std::size_t t = 0; t < triangles.size(); t += 3)
    sum += length(doubled_area({polygon[triangles[t]], polygon[triangles[t + 1]], polygon[triangles[t + 2]]}));
  return sum / length(doubled_area(polygon));
}

double turn(const Vec3& a, const Vec3& b, const Vec3& p) { return cross(b - a, p - a)[2]; }

// How often an outline in the plane z = 0 goes around a point.
int winding(const std::vector<Vec3>& outline, const Vec3& p) {
  int count = 0;
  for (std::size_t k = 0; k < outline.size(); ++k) {
    const Vec3 &a = outline[k], &b = outline[(k + 1) % outline.size()];
    if (a[1] <= p[1] && b[1] > p[1] && turn(a, b, p) > 0) ++count;
    if (a[1] > p[1] && b[1] <= p[1] && turn(a, b, p) < 0) --count;
  }
  return count;
}

bool is_covered(const std::vector<Vec3>& polygon, const Triangles& triangles, const Vec3& p) {
  for (std::size_t t = 0; t < triangles.size(); t += 3)
    if (winding({polygon[triangles[t]], polygon[triangles[t + 1]], polygon[triangles[t + 2]]}, p) != 0) return true;
  return false;
}

}  // namespace

TEST_CASE("a convex polygon is a fan about its first corner, also with corners on its edges and in one place") {
  CHECK(cut({{0, 0, 0}, {1, 0, 0}}).empty());
  CHECK(cut({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}) == Triangles{0, 1, 2});
  CHECK(cut({{0, 0, 0}, {0, 1, 0}, {1, 1, 0}, {1, 0, 0}}) == Triangles{0, 1, 2, 0, 2, 3});
  CHECK(cut({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {2, 2, 0}, {2, 2, 0}}) == Triangles{0, 1, 2, 0, 2, 3, 0, 3, 4});
  CHECK(cut({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {1, 0, 0}}) == Triangles{0, 1, 2, 0, 2, 3});  // without area
}

TEST_CASE("triangles of a concave polygon turn as it does and leave its hollows and holes free") {
  const std::vector<Vec3> dart = {{0, 0, 0}, {2, 2, 0}, {0, 1, 0}, {-2, 2, 0}};
  CHECK(cut(dart).size() == 6);
  CHECK(area_ratio(dart, cut(dart)) == 1);
  // A square hole, which an edge there and back joins to a square with a corner on an edge.
  const std::vector<Vec3> frame = {{0, 0, 0}, {2, 0, 0}, {4, 0, 0}, {4, 4, 0}, {0, 4, 0}, {0, 0, 0},
                                   {1, 1, 0}, {1, 3, 0}, {3, 3, 0}, {3, 2, 0}, {3, 1, 0}, {1, 1, 0}};
  CHECK(cut(frame).size() == 30);
  CHECK(area_ratio(frame, cut(frame)) == 1);

  Random random(7);
  for (int round = 0; round < 2000; ++round) {
    CAPTURE(round);
    const Vec3 x = {random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
    const Vec3 y = {random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
    std::vector<Vec3> star;
    const int count = 4 + round % 30;
    for (int k = 0; k < count; ++k) {
      const double angle = 6.283185307179586 * k / count, radius = random.uniform(.1, 1);
      const Vec3 corner = radius * std::cos(angle) * x + radius * std::sin(angle) * y;
      star.push_back({static_cast<float>(corner[0]), static_cast<float>(corner[1]), static_cast<float>(corner[2])});
    }
    const Triangles triangles = cut(star);
    REQUIRE(triangles.size() == 3 * (star.size() - 2));
    CHECK(std::fabs(area_ratio(star, triangles) - 1) < kMostAdded);
    for (std::size_t t = 0; t < triangles.size(); t += 3)
      CHECK(dot(doubled_area({star[triangles[t]], star[triangles[t + 1]], star[triangles[t + 2]]}),
                doubled_area(star)) > 0);
  }
}

TEST_CASE("a polygon of very many corners is a fan, whatever its hollows") {
  std::vector<Vec3> star;
  for (int k = 0; k < 100000; ++k) {
    const double angle = k * 6.283185307179586 / 100000, radius = k % 2 == 0 ? 1 : .5;
    star.push_back({radius * std::cos(angle), radius * std::sin(angle), 0});
  }
  std::vector<std::uint32_t> triangles;
  cut_polygon(star, triangles);
  REQUIRE(triangles.size() == 3 * (star.size() - 2));
  CHECK(std::vector<std::uint32_t>(triangles.end() - 3, triangles.end()) ==
        std::vector<std::uint32_t>{0, 99998, 99999});
}

TEST_CASE("whatever an outline goes around is in a triangle, also if it crosses itself") {
  Random random(8);
  for (int round = 0; round < 500; ++round) {
    CAPTURE(round);
    std::vector<Vec3> outline;
    for (int k = 0; k < 4 + round % 12; ++k) outline.push_back({random.uniform(-1, 1), random.uniform(-1, 1), 0});
    const Triangles triangles = cut(outline);
    REQUIRE(triangles.size() == 3 * (outline.size() - 2));
    for (int k = 0; k < 100; ++k) {
      const Vec3 point = {random.uniform(-1, 1), random.uniform(-1, 1), 0};
      if (winding(outline, point) != 0) CHECK(is_covered(outline, triangles, point));
    }
  }
}
