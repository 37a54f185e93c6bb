// Faces and edges of hulls that are known.
#include <doctest/doctest.h>

#include <cmath>
#include <cstddef>
#include <vector>

#include "perf/judge/oracle/convex_faces.h"

namespace {

using cab::oracle::dot;
using cab::oracle::find_faces;
using cab::oracle::HullEdge;
using cab::oracle::HullFaces;
using cab::oracle::magnitude;
using cab::oracle::Point;
using cab::oracle::Real;

// Rounding of a normal; the worst measured is 2e-19.
constexpr Real kTolerance = 1e-17L;

// The corners of a cube, then its centre and the centre of a face, which are no vertices.
std::vector<Point> cube_with_inner_points() {
  std::vector<Point> out;
  for (unsigned i = 0; i < 8; ++i) out.push_back({{i & 1 ? 1.0L : -1.0L, i & 2 ? 1.0L : -1.0L, i & 4 ? 1.0L : -1.0L}});
  out.push_back({{0, 0, 0}});
  out.push_back({{1, 0, 0}});
  return out;
}

// Whether normals have length 1 and are normal to their edges.
void check_normals(const HullFaces& faces) {
  for (const Point& normal : faces.normals) CHECK(magnitude(dot(normal, normal) - 1) <= kTolerance);
  for (const HullEdge& edge : faces.edges)
    for (const Point& normal : edge.normal) CHECK(magnitude(dot(normal, edge.along)) <= kTolerance);
}

TEST_CASE("a cube has six faces and twelve edges, whatever points are within it") {
  const HullFaces faces = find_faces(cube_with_inner_points());
  CHECK(faces.normals.size() == 6);
  CHECK(faces.edges.size() == 12);
  check_normals(faces);
  for (const HullEdge& edge : faces.edges) {
    CHECK(dot(edge.along, edge.along) == 4);
    CHECK(magnitude(dot(edge.normal[0], edge.normal[1])) <= kTolerance);
  }
}

TEST_CASE("all points lie below each face of a hull") {
  std::vector<Point> points;
  for (int i = 0; i < 20; ++i) {
    const Real z = 1 - (2 * i + 1) / 20.0L, radius = std::sqrt(1 - z * z), angle = 2.4L * i;
    points.push_back({{radius * std::cos(angle), radius * std::sin(angle), z}});
  }
  const HullFaces faces = find_faces(points);
  // Euler's formula for triangles.
  CHECK(faces.normals.size() == 2 * points.size() - 4);
  CHECK(faces.edges.size() == 3 * points.size() - 6);
  check_normals(faces);
  for (const Point& normal : faces.normals) {
    std::size_t on = 0;
    Real highest = dot(normal, points.front());
    for (const Point& p : points) highest = std::fmax(highest, dot(normal, p));
    for (const Point& p : points) on += highest - dot(normal, p) <= kTolerance ? 1 : 0;
    CHECK(on == 3);
  }
}

TEST_CASE("a hull in one plane has two faces, and each edge leads from one over its side to the other") {
  const std::vector<Point> square = {{{0, 0, 3}}, {{1, 0, 3}}, {{1, 1, 3}}, {{0, 1, 3}}, {{0.5L, 0.5L, 3}}};
  const HullFaces faces = find_faces(square);
  CHECK(faces.normals.size() == 2);
  CHECK(magnitude(dot(faces.normals[0], faces.normals[1]) + 1) <= kTolerance);
  // Each of the four edges is found from both ends.
  std::size_t sides = 0;
  for (const HullEdge& edge : faces.edges) sides += magnitude(edge.normal[1][2]) <= kTolerance ? 1 : 0;
  CHECK(sides == 4);
  check_normals(faces);
}

TEST_CASE("a hull in one line has normals all around it, and a single point has one") {
  const std::vector<Point> line = {{{1, 1, 1}}, {{2, 2, 2}}, {{4, 4, 4}}};
  const HullFaces faces = find_faces(line);
  CHECK(faces.normals.size() == 4);
  CHECK(faces.edges.size() == 4);
  check_normals(faces);
  const std::vector<Point> twice = {{{1, 2, 3}}, {{1, 2, 3}}};
  const HullFaces of_point = find_faces(twice);
  CHECK(of_point.normals.size() == 1);
  CHECK(of_point.edges.empty());
}

}  // namespace
