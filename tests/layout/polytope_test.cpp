// Faces and edges of hulls, beside those that the judge finds by trying every plane through three vertices.
#include "layout/polytope.h"

#include "layout/arena.h"
#include "perf/judge/oracle/convex_faces.h"
#include "perf/judge/oracle/random.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace {

using namespace cab;
using namespace cab::tests;
using oracle::Point;
using oracle::Random;
using oracle::Real;

// What rounding and the joining of faces leave of a normal.
constexpr Real kNear = 1e-5L;

enum Form { kBall, kFlat, kGrid, kNeedle, kPrism, kFormCount };

// Vertices of one form, about the origin and at most 1 away from it along an axis.
std::vector<double> vertices_of(Random& random, Form form) {
  std::vector<double> out;
  const std::uint32_t count = 4 + random.index(form == kBall ? 61 : 20);
  if (form == kPrism) {  // two polygons, whose faces are all but in one plane after they were rounded
    const double turn = random.uniform(0, 6);
    const std::uint32_t corners = 3 + count % 12;
    for (std::uint32_t i = 0; i < 2 * corners; ++i) {
      const double angle = turn + 6.283185307179586 * (i / 2) / corners;
      for (const double c : {0.8 * std::cos(angle), 0.5, 0.8 * std::sin(angle)})
        out.push_back(static_cast<double>(static_cast<float>(c * (c == 0.5 && i % 2 ? -1 : 1))));
    }
    return out;
  }
  for (std::uint32_t i = 0; i < count; ++i) {
    double at[3] = {random.normal(), random.normal(), random.normal()};
    const double length = std::sqrt(at[0] * at[0] + at[1] * at[1] + at[2] * at[2]);
    for (std::size_t c = 0; c < 3; ++c) {
      if (form == kBall) at[c] /= length;
      if (form == kFlat) at[c] = c == 2 ? 0.25 : std::clamp(at[c] / 3, -1.0, 1.0);
      if (form == kGrid)
        at[c] = (random.index(3) - 1.0) * (1.0 + static_cast<double>(c)) /
                3;  // many in one plane, in one line, or the same
      if (form == kNeedle) at[c] = std::clamp(at[c] / 3, -1.0, 1.0) * (c == 0 ? 1 : 1e-3);
      out.push_back(static_cast<double>(static_cast<float>(at[c])));
    }
  }
  return out;
}

Point at(const double* from, std::size_t i) { return {{from[3 * i], from[3 * i + 1], from[3 * i + 2]}}; }

Real height(const std::vector<double>& vertices, const Point& along) {
  Real out = -2;
  for (std::size_t v = 0; 3 * v < vertices.size(); ++v) out = std::max(out, dot(along, at(vertices.data(), v)));
  return out;
}

bool has(const std::vector<Point>& normals, const Point& one) {
  return std::any_of(normals.begin(), normals.end(),
                     [&](const Point& n) { return dot(n - one, n - one) < kNear * kNear; });
}

// Whether a polytope has the same vertices, in any order.
bool is_permutation_of(const Polytope& polytope, const std::vector<double>& vertices) {
  std::vector<std::array<double, 3>> own, given;
  for (std::size_t v = 0; v < polytope.vertex_count; ++v) {
    const double* const p = polytope.exact_vertices + 3 * v;
    own.push_back({p[0], p[1], p[2]});
    given.push_back({vertices[3 * v], vertices[3 * v + 1], vertices[3 * v + 2]});
  }
  std::sort(own.begin(), own.end());
  std::sort(given.begin(), given.end());
  return own == given;
}

// Whether the direction of an edge is that of a vector, rounded.
bool is_along(const PolytopeEdge& edge, const Point& along) {
  const Point direction = {{edge.direction[0], edge.direction[1], edge.direction[2]}};
  const Point off = direction - (1 / std::sqrt(dot(along, along))) * along;
  return dot(off, off) < 0x1p-46L;
}

}  // namespace

TEST_CASE("a polytope has the faces and edges of its hull, with short arcs between the normals of every edge") {
  std::uint64_t made = 0, flat = 0, between = 0;
  for (std::uint64_t round = 0; round < rounds(400); ++round) {
    CAPTURE(round);
    Random random(round + 1);
    const std::vector<double> vertices = vertices_of(random, static_cast<Form>(round % kFormCount));
    Arena arena{default_allocator()};
    const Polytope* const polytope = make_polytope(vertices, arena);
    std::vector<Point> points;
    for (std::size_t v = 0; 3 * v < vertices.size(); ++v) points.push_back(at(vertices.data(), v));
    const oracle::HullFaces right = oracle::find_faces(points);
    const bool is_line = right.edges.size() <= 4 && right.normals.size() <= 4 && round % kFormCount == kGrid;
    if (!polytope) {
      CHECK(is_line);
      continue;
    }
    ++made;
    REQUIRE(polytope->vertex_count == points.size());
    CHECK(is_permutation_of(*polytope, vertices));
    for (std::size_t v = 0; v < points.size(); ++v) points[v] = at(polytope->exact_vertices, v);
    std::vector<Point> normals;
    for (std::uint32_t f = 0; f < polytope->face_count; ++f) normals.push_back(at(polytope->exact_normals, f));
    for (const Point& normal : right.normals) CHECK(has(normals, normal));
    std::uint32_t extra = 0;
    for (const Point& normal : normals) {
      CHECK(std::fabs(dot(normal, normal) - 1) < 1e-12L);
      extra += !has(right.normals, normal);
    }
    CHECK(2 * extra <= polytope->edge_count);
    between += extra;
    flat += right.normals.size() == 2;
    for (std::uint32_t e = 0; e < polytope->edge_count; ++e) {
      const PolytopeEdge& edge = polytope->edges[e];
      const Point &n = normals[edge.face[0]], &m = normals[edge.face[1]];
      CHECK(dot(n, m) > -0.51L);
      REQUIRE(edge.vertex[0] != edge.vertex[1]);
      CHECK(is_along(edge, points[edge.vertex[1]] - points[edge.vertex[0]]));
      // Both ends are farthest along both normals, and so along all of the arc.
      for (const Point& normal : {n, m})
        for (const std::uint16_t v : edge.vertex) CHECK(dot(normal, points[v]) >= height(vertices, normal) - kNear);
    }
    // Every edge of the hull is there: along the middle of its arc some edge has both of its ends.
    for (const oracle::HullEdge& edge : right.edges) {
      const Point middle = edge.normal[0] + edge.normal[1];
      if (dot(middle, middle) < 1e-3L || dot(edge.normal[0] - edge.normal[1], edge.normal[0] - edge.normal[1]) < kNear)
        continue;
      const Real top = height(vertices, middle) - kNear;
      bool found = false;
      for (std::uint32_t e = 0; e < polytope->edge_count; ++e)
        found = found || (dot(middle, points[polytope->edges[e].vertex[0]]) >= top &&
                          dot(middle, points[polytope->edges[e].vertex[1]]) >= top);
      CHECK(found);
    }
  }
  CHECK(made * 10 >= rounds(400) * 9);
  CHECK(flat > 0);
  CHECK(between > 0);
}

TEST_CASE("arrays of a polytope hold what is exact, rounded, and are padded with the last element") {
  Random random(7);
  Arena arena{default_allocator()};
  for (const std::uint32_t form : {kBall, kFlat}) {
    const std::vector<double> vertices = vertices_of(random, static_cast<Form>(form));
    const Polytope* const polytope = make_polytope(vertices, arena);
    REQUIRE(polytope);
    const std::uint32_t count = polytope->vertex_count, faces = polytope->face_count;
    CHECK(count == vertices.size() / 3);
    for (std::uint32_t c = 0; c < 3; ++c) {
      for (std::uint32_t v = 0; v < padded_for_lanes(count); ++v)
        CHECK(polytope->vertices[c * padded_for_lanes(count) + v] ==
              static_cast<float>(polytope->exact_vertices[3 * std::min(v, count - 1) + c]));
      for (std::uint32_t f = 0; f < padded_for_lanes(faces); ++f)
        CHECK(polytope->faces[c * padded_for_lanes(faces) + f] ==
              static_cast<float>(polytope->exact_normals[3 * std::min(f, faces - 1) + c]));
    }
    for (std::uint32_t f = 0; f < padded_for_lanes(faces); ++f) {
      const auto component = [&](std::uint32_t c) { return Real{polytope->faces[c * padded_for_lanes(faces) + f]}; };
      const Point normal = {{component(0), component(1), component(2)}},
                  on = {{component(3), component(4), component(5)}};
      CHECK(std::fabs(dot(normal, on) - height(vertices, normal)) < kNear);
    }
  }
}

TEST_CASE("the first vertices are far from each other, and half arcs hold the middle of every edge's arc") {
  Random random(11);
  Arena arena{default_allocator()};
  for (const std::uint32_t form : {kBall, kGrid, kNeedle, kPrism}) {
    CAPTURE(form);
    const std::vector<double> vertices = vertices_of(random, static_cast<Form>(form));
    const Polytope* const polytope = make_polytope(vertices, arena);
    REQUIRE(polytope);
    const std::uint32_t padded = padded_for_lanes(polytope->face_count);
    for (std::uint32_t e = 0; e < polytope->edge_count; ++e) {
      const std::uint16_t(&face)[2] = polytope->edges[e].face;
      const Point n = at(polytope->exact_normals, face[0]), m = at(polytope->exact_normals, face[1]);
      const Real half = std::acos(std::clamp(dot(n, m), Real{-1}, Real{1})) / 2;
      for (const std::uint16_t f : face) {
        CHECK(polytope->faces[6 * padded + f] <= std::cos(half) + 1e-7L);
        CHECK(polytope->faces[7 * padded + f] >= std::sin(half) - 1e-7L);
      }
    }
    // No vertex is farther from all of the first than the first are from each other.
    const auto distance = [&](std::uint32_t a, std::uint32_t b) {
      const Point off = at(polytope->exact_vertices, a) - at(polytope->exact_vertices, b);
      return std::sqrt(dot(off, off));
    };
    if (polytope->vertex_count <= kSpreadVertices) continue;
    Real closest = 10, farthest = 0;
    for (std::uint32_t a = 0; a < kSpreadVertices; ++a)
      for (std::uint32_t b = 0; b < a; ++b) closest = std::min(closest, distance(a, b));
    for (std::uint32_t v = kSpreadVertices; v < polytope->vertex_count; ++v) {
      Real nearest = 10;
      for (std::uint32_t a = 0; a < kSpreadVertices; ++a) nearest = std::min(nearest, distance(a, v));
      farthest = std::max(farthest, nearest);
    }
    CHECK(farthest <= closest);
  }
}

TEST_CASE("the cube is the polytope of its eight vertices") {
  std::vector<double> vertices;
  for (int v = 0; v < 8; ++v)
    for (int c = 0; c < 3; ++c) vertices.push_back(v >> c & 1 ? 1 : -1);
  Arena arena{default_allocator()};
  const Polytope* const hull = make_polytope(vertices, arena);
  const Polytope& cube = unit_cube();
  REQUIRE(hull);
  CHECK(hull->face_count == cube.face_count);
  CHECK(hull->edge_count == cube.edge_count);
  std::vector<Point> normals;
  for (std::uint32_t f = 0; f < 6; ++f) normals.push_back(at(hull->exact_normals, f));
  for (std::uint32_t f = 0; f < 6; ++f) {
    CHECK(has(normals, at(cube.exact_normals, f)));
    for (std::uint32_t c = 0; c < 3; ++c)
      CHECK(cube.faces[c * 16 + f] == static_cast<float>(cube.exact_normals[3 * f + c]));
    Real offset = 0;
    for (std::uint32_t c = 0; c < 3; ++c) offset += Real{cube.faces[c * 16 + f]} * cube.faces[(3 + c) * 16 + f];
    CHECK(offset == 1);
    // Of half a right angle, rounded to a wider arc.
    const Real cosine = cube.faces[6 * 16 + f], sine = cube.faces[7 * 16 + f], half = std::sqrt(Real{0.5});
    CHECK((cosine <= half && cosine > half - 1e-4L));
    CHECK((sine >= half && sine < half + 1e-4L));
  }
  for (std::uint32_t v = 0; v < 16; ++v)
    for (std::uint32_t c = 0; c < 3; ++c)
      CHECK(cube.vertices[c * 16 + v] == static_cast<float>(vertices[3 * std::min(v, 7u) + c]));
  for (std::uint32_t e = 0; e < 12; ++e) {
    int shared = 0;
    for (std::uint32_t c = 0; c < 3; ++c)
      shared +=
          cube.exact_vertices[3 * cube.edges[e].vertex[0] + c] == cube.exact_vertices[3 * cube.edges[e].vertex[1] + c];
    CHECK(shared == 2);
    CHECK(is_along(cube.edges[e], at(cube.exact_vertices, cube.edges[e].vertex[1]) -
                                      at(cube.exact_vertices, cube.edges[e].vertex[0])));
    for (const std::uint16_t face : cube.edges[e].face)
      for (const std::uint16_t v : cube.edges[e].vertex)
        CHECK(dot(at(cube.exact_normals, face), at(cube.exact_vertices, v)) == 1);
  }
}

TEST_CASE("what is no more than a line, or has too many vertices, is no polytope") {
  Arena arena{default_allocator()};
  CHECK(make_polytope({}, arena) == nullptr);
  const double line[] = {0, 0, 0, 1, 1, 1, 0.5, 0.5, 0.5, -1, -1, -1};
  for (std::size_t count = 3; count <= 12; count += 3) CHECK(make_polytope({line, count}, arena) == nullptr);
  const double same[12] = {};
  CHECK(make_polytope(same, arena) == nullptr);
  Random random(3);
  std::vector<double> many;
  for (std::uint32_t i = 0; i < 3 * kMostVertices; ++i) many.push_back(random.uniform(-1, 1));
  CHECK(make_polytope(many, arena) != nullptr);
  for (int c = 0; c < 3; ++c) many.push_back(random.uniform(-1, 1));
  CHECK(make_polytope(many, arena) == nullptr);
}
