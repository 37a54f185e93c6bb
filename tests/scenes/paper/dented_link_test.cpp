// The dented link of Table 3: its convex pieces, and the mesh that bounds them.
#include "scenes/paper/dented_link.h"

#include "perf/judge/oracle/random.h"
#include "tests/scenes/paper/leaf_boxes.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

namespace {

using namespace cab::tests;

// Tolerance for the planes of the pieces. Vertices are rounded to float, so a face of more than three vertices is plane
// to about 1e-7.
constexpr double kPlane = 1e-6;

std::vector<Vec3> points(const std::vector<float>& xyz) {
  std::vector<Vec3> result;
  for (std::size_t i = 0; i < xyz.size(); i += 3) result.push_back({xyz[i], xyz[i + 1], xyz[i + 2]});
  return result;
}

struct Plane {
  Vec3 normal;  // outwards
  double offset;
  double height(const Vec3& p) const { return dot(normal, p) - offset; }
};

// The planes through three points with all other points on one side: the faces of the hull, some more than once.
std::vector<Plane> hull_planes(const std::vector<Vec3>& p) {
  std::vector<Plane> planes;
  for (std::size_t i = 0; i < p.size(); ++i) {
    for (std::size_t j = i + 1; j < p.size(); ++j) {
      for (std::size_t k = j + 1; k < p.size(); ++k) {
        const Vec3 n = cross(p[j] - p[i], p[k] - p[i]);
        if (length(n) < 1e-9) continue;
        for (const double sign : {-1.0, 1.0}) {
          Plane plane = {(sign / length(n)) * n, 0};
          plane.offset = dot(plane.normal, p[i]);
          if (std::all_of(p.begin(), p.end(), [&](const Vec3& q) { return plane.height(q) < kPlane; }))
            planes.push_back(plane);
        }
      }
    }
  }
  return planes;
}

// The distance of a point outside the planes, negative inside.
double height_above(const std::vector<Plane>& planes, const Vec3& p) {
  double height = -1e9;
  for (const Plane& plane : planes) height = std::max(height, plane.height(p));
  return height;
}

struct Triangle {
  std::array<Vec3, 3> corners;
};

std::vector<Triangle> triangles(const TriangleMesh& mesh) {
  const std::vector<Vec3> p = points(mesh.vertices);
  std::vector<Triangle> result;
  for (std::size_t t = 0; t < mesh.triangles.size(); t += 3)
    result.push_back({{p[mesh.triangles[t]], p[mesh.triangles[t + 1]], p[mesh.triangles[t + 2]]}});
  return result;
}

// The winding number of the surface about a point: 1 inside, 0 outside. Solid angles after Van Oosterom and Strackee
// 1983.
double winding(const std::vector<Triangle>& surface, const Vec3& p) {
  double angle = 0;
  for (const Triangle& t : surface) {
    const Vec3 a = t.corners[0] - p, b = t.corners[1] - p, c = t.corners[2] - p;
    const double la = length(a), lb = length(b), lc = length(c);
    angle += 2 * std::atan2(dot(a, cross(b, c)), la * lb * lc + dot(a, b) * lc + dot(a, c) * lb + dot(b, c) * la);
  }
  return angle / (4 * std::acos(-1.0));
}

}  // namespace

TEST_CASE("the dented link has 12 pieces of six or nine vertices that lie in its leaf box") {
  const std::vector<std::vector<float>> pieces = dented_link_pieces();
  REQUIRE(pieces.size() == 12);
  for (std::size_t piece = 0; piece < pieces.size(); ++piece) {
    const bool at_pole = piece < 3 || piece >= 9;
    CHECK(pieces[piece].size() == (at_pole ? 18 : 27));
    for (std::size_t i = 0; i < pieces[piece].size(); ++i)
      CHECK(std::fabs(pieces[piece][i]) <= static_cast<float>(kDentedHalf[i % 3]));
    // All points of a hull without volume would lie in each of its planes.
    const std::vector<Vec3> p = points(pieces[piece]);
    double depth = 1e9;
    for (const Plane& plane : hull_planes(p)) {
      double lowest = 0;
      for (const Vec3& q : p) lowest = std::min(lowest, plane.height(q));
      depth = std::min(depth, -lowest);
    }
    CHECK(depth > .1);  // the thinnest piece measures .136
  }
}

TEST_CASE("the first pieces' vertices are where the equations put them") {
  // Piece (0, 0) by hand: the pole at theta = 0; then theta = 45 degrees, s = -2^-.375 = -.7711054, r = .7711054, at
  // phi = 0: y = -1, z = 0, and phi = 60: y = -.5^.75 = -.5946036, z = -(3^.5 / 2)^.75 = -.8977351; the inner ones
  // have y (1 + .75)/2 and z .75; the middle at 22.5 and 30 degrees.
  const std::vector<Vec3> p = points(dented_link_pieces()[0]);
  const double h = .7711054;
  const double m = .4865525;  // sin(22.5 degrees)^.75
  const std::vector<Vec3> expected = {
      {-3, 0, .2},
      {-3 * h, -.5 * h, .2},
      {-3 * h, -.5 * h * .5946036, .2 - .4 * h * .8977351},
      {-3 * h, -.4375 * h, .2},
      {-3 * h, -.4375 * h * .5946036, .2 - .3 * h * .8977351},
      {-3 * .9423484, -.5 * m * .8977351, .2 - .4 * m * .5946036},
  };
  REQUIRE(p.size() == expected.size());
  for (std::size_t i = 0; i < p.size(); ++i) {
    CAPTURE(i);
    CHECK(length(p[i] - expected[i]) < 1e-6);
  }
}

TEST_CASE("the mesh of the dented link is closed, a sphere by its topology, and winds outwards") {
  const TriangleMesh mesh = dented_link_mesh();
  REQUIRE(mesh.vertices.size() == 38 * 3);
  REQUIRE(mesh.triangles.size() == 72 * 3);
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (std::size_t t = 0; t < mesh.triangles.size(); t += 3) {
    for (std::size_t e = 0; e < 3; ++e) {
      REQUIRE(mesh.triangles[t + e] < 38);
      ++edges[{mesh.triangles[t + e], mesh.triangles[t + (e + 1) % 3]}];
    }
  }
  CHECK(38 - edges.size() / 2 + 72 == 2);  // Euler
  for (const auto& [edge, count] : edges) {
    CHECK(count == 1);
    CHECK(edges.count({edge.second, edge.first}) == 1);
  }
  double volume = 0;
  for (const Triangle& t : triangles(mesh)) {
    CHECK(length(cross(t.corners[1] - t.corners[0], t.corners[2] - t.corners[0])) > 1e-3);
    volume += dot(t.corners[0], cross(t.corners[1], t.corners[2])) / 6;
  }
  CHECK(volume > 0);
}

TEST_CASE("a point is inside the mesh of the dented link exactly when it is in one of the pieces") {
  const std::vector<Triangle> surface = triangles(dented_link_mesh());
  std::vector<std::vector<Plane>> pieces;
  for (const std::vector<float>& piece : dented_link_pieces()) pieces.push_back(hull_planes(points(piece)));
  cab::oracle::Random random(3);
  int inside = 0, in_two = 0;
  for (int sample = 0; sample < 4000; ++sample) {
    const Vec3 p = {random.uniform(-3, 3), random.uniform(-.5, .5), random.uniform(-.2, .2)};
    std::vector<double> heights;
    heights.reserve(pieces.size());
    for (const std::vector<Plane>& piece : pieces) heights.push_back(height_above(piece, p));
    if (std::any_of(heights.begin(), heights.end(), [](double height) { return std::fabs(height) < 1e-5; })) continue;
    const auto holders = std::count_if(heights.begin(), heights.end(), [](double height) { return height < 0; });
    CAPTURE(sample);
    REQUIRE(winding(surface, p) == doctest::Approx(holders > 0 ? 1 : 0).epsilon(1e-6));
    inside += holders > 0 ? 1 : 0;
    in_two += holders > 1 ? 1 : 0;
  }
  CHECK(inside > 400);
  CHECK(in_two == 0);  // pieces share only faces
}
